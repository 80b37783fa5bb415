# SPDX-License-Identifier: MIT
"""One process at a time in a folder: a lock that the operating system gives back when its holder dies.

What counts is the lock on the file, not that the file is there, so a killed process leaves nothing to clean up.
"""

from __future__ import annotations

import errno
import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from ..exceptions import VtgtsamError

logger = logging.getLogger(__name__)

_HELD = (errno.EWOULDBLOCK, errno.EACCES, errno.EDEADLK)
_UNSUPPORTED = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS)


@contextmanager
def locked(path: Path, what: str) -> Iterator[None]:
    """Hold the lock on a file, which is made where it is missing and stays, empty.

    Args:
        path: The file.
        what: What is locked, for the message.

    Raises:
        VtgtsamError: Another process, or another thread of this one, holds it.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a+") as file:
        try:
            _lock(file)
        except OSError as error:
            if error.errno in _HELD:
                raise VtgtsamError(
                    f"{what} is in use by another call{_holder(file)}; wait until it ends, or give another folder"
                ) from None
            if error.errno not in _UNSUPPORTED:
                raise
            logger.warning(
                "%s: the file system has no locks, so nothing keeps a second call away", what
            )
        file.truncate(0)
        file.write(str(os.getpid()))
        file.flush()
        try:
            yield
        finally:
            file.truncate(0)


def _holder(file: IO[str]) -> str:
    file.seek(0)
    number = file.read(20)
    return f" (process {number})" if number.isdecimal() else ""


if os.name == "nt":  # pragma: no cover
    import msvcrt

    def _lock(file: IO[str]) -> None:
        file.seek(0)
        msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined, unused-ignore]

else:
    import fcntl

    def _lock(file: IO[str]) -> None:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
