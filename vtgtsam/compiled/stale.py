# SPDX-License-Identifier: MIT
"""Machine code on disk that no longer fits its sources is removed before anything loads it.

Numba looks only at the file a function is in: when a function that it calls or inlines changes in another file, or a
number that it reads there, the old machine code goes on being used. So one change anywhere in a folder that holds
compiled functions lets go of all of it.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from pathlib import Path

STAMP = "compiled.sha256"
MARKS = (b"@compiled", b"@inlined")  # a source with one of them holds compiled functions


def drop_stale(package: Path) -> None:
    """Remove the machine code below a package's folder if compiled sources, or those beside them, changed since.

    Where the folder cannot be written to, Numba keeps no machine code in it either.
    """
    stamp = package / "__pycache__" / STAMP
    digest = _digest(package)
    if stamp.is_file() and stamp.read_text() == digest:
        return
    with contextlib.suppress(OSError):
        for pattern in ("*.nbi", "*.nbc"):
            for file in package.rglob(f"__pycache__/{pattern}"):
                file.unlink(missing_ok=True)
        stamp.parent.mkdir(exist_ok=True)
        part = stamp.with_suffix(f".{os.getpid()}")
        part.write_text(digest)
        part.replace(stamp)  # other processes may be at the same


def _digest(package: Path) -> str:
    digest = hashlib.sha256()
    texts = {source: source.read_bytes() for source in sorted(package.rglob("*.py"))}
    folders = {
        source.parent for source, text in texts.items() if any(mark in text for mark in MARKS)
    }
    for source, text in texts.items():
        if source.parent in folders:
            digest.update(source.relative_to(package).as_posix().encode() + text)
    return digest.hexdigest()
