# SPDX-License-Identifier: MIT
"""The edge of a command line: an error of the data is one sentence, and a traceback means a fault of ours."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager

from ..exceptions import VtgtsamError
from ..extras import explained
from ..input.plain import sentence
from .signals import blocks_left_first


@contextmanager
def edge(program: str) -> Iterator[None]:
    """Run a command line inside; exit code 1 after an error.

    Args:
        program: Its name, which begins the sentence.
    """
    try:
        with blocks_left_first():
            yield
    except (VtgtsamError, OSError) as error:
        sys.exit(_said(program, error))
    except MemoryError:
        sys.exit(_said(program, "there is not enough memory for this"))
    except Exception as error:
        if isinstance(error, ModuleNotFoundError):
            found = explained(error, "this needs")
            if isinstance(found, VtgtsamError):
                sys.exit(_said(program, found))
        traceback.print_exc()
        sys.exit(
            _said(
                program,
                "this is a fault of vtgtsam, not of what it was given; please report it with the lines above",
            )
        )


def _said(program: str, problem: object) -> int:
    print(f"{program}: {sentence(problem)}", file=sys.stderr)
    return 1
