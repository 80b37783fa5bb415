# SPDX-License-Identifier: MIT
"""What is mutated, and how it is used: by the library, then by a command."""

from __future__ import annotations

import io
import sys
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vtgtsam import cli
from vtgtsam.exceptions import VtgtsamError


@dataclass(frozen=True)
class Kind:
    """One kind of input.

    Attributes:
        names: File names of its seeds; the suffix decides what reads them.
        seeds: Makes the seeds' contents in a folder, in that order.
        use: Puts a mutated file, which lies in the folder, to use; answers with what is wrong, or "".
    """

    names: tuple[str, ...]
    seeds: Callable[[Path], list[bytes]]
    use: Callable[[Path, Path, np.random.Generator], str]


def library(call: Callable[[], object]) -> str:
    """Call it; only our own errors and the system's may come out."""
    try:
        call()
    except (VtgtsamError, OSError):
        return ""
    except Exception:
        return "the library raised\n" + traceback.format_exc()
    return ""


def run(*arguments: object) -> tuple[object, str]:
    """Run the command line in this process: its exit code, and all that it printed."""
    sys.argv = ["vtgtsam", *map(str, arguments)]
    said = io.StringIO()
    out, err, sys.stdout, sys.stderr = sys.stdout, sys.stderr, said, said
    try:
        cli.main()
        code: object = 0
    except SystemExit as stopped:
        code = stopped.code or 0
    finally:
        sys.stdout, sys.stderr = out, err
    return code, said.getvalue()


def command(*arguments: object) -> str:
    """Run the command line in this process; answers with what is wrong."""
    return judged(arguments[0], *run(*arguments))


def judged(name: object, code: object, text: str) -> str:
    """What is wrong with how a command ended and with what it printed."""
    print(text)
    if "Traceback" in text:
        return f"{name} shows a traceback:\n{text[-3000:]}"
    if code not in (0, 1, 2, 3):
        return f"{name} ends with code {code}"
    if not all(line.isprintable() for line in text.splitlines()) or "\x1b" in text:
        return f"{name} prints control characters: {text[-1000:]!r}"
    return ""
