# SPDX-License-Identifier: MIT
"""Files that are either whole or not there, whenever the process is killed."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

LEFTOVER = ".tmp"  # ends the names of temporary files, which begin with a dot


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary path beside ``path`` to write to, and move it there when all went well."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}{LEFTOVER}")
    try:
        with naming(path, temporary):
            yield temporary
            os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def naming(path: Path, instead_of: Path | None = None) -> Iterator[None]:
    """Give an error of the system the file's name where it has none: a full disk is told without one.

    Args:
        path: The file.
        instead_of: Another name of it, which is replaced in the error too.
    """
    try:
        yield
    except OSError as error:
        if error.filename in (None, str(instead_of)):
            error.filename = str(path)
        raise


def remove_leftovers(path: Path) -> None:
    """Remove what ``replacing`` of this path left beside it when the process was killed."""
    for other in path.parent.glob(f".*{LEFTOVER}"):
        if re.fullmatch(rf"\.{re.escape(path.name)}\.\d+{re.escape(LEFTOVER)}", other.name):
            other.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file in one step, with the same bytes on every system."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
