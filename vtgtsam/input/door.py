# SPDX-License-Identifier: MIT
"""Where data enters: whatever a library raises on it becomes one sentence that names the data."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from ..exceptions import VtgtsamError
from .plain import plain

logger = logging.getLogger(__name__)


@contextmanager
def reading(what: object, error: type[VtgtsamError]) -> Iterator[None]:
    """Turn what parsers raise on damaged or hostile data into an error of this package.

    Only data is handled inside, no arguments of a caller: those are checked before.

    Args:
        what: The data, as in "can.obj" or "the attached hand".
        error: Kind of the error.

    Raises:
        VtgtsamError: Of that kind, or as it was raised inside.
    """
    try:
        yield
    except (VtgtsamError, OSError):
        raise
    except MemoryError:
        raise error(f"{what} asks for more memory than there is") from None
    except RecursionError:
        raise error(f"{what} is nested too deeply") from None
    except Exception as problem:
        logger.debug("%s", what, exc_info=True)
        words = " ".join(str(problem).split())
        kind = "" if isinstance(problem, ValueError) and words else f"{type(problem).__name__}: "
        raise error(f"{what} cannot be used: {kind}{plain(words)}") from problem
