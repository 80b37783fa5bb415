# SPDX-License-Identifier: MIT
"""Whose a results folder is, and which of its files an evaluation made: no other is ever replaced or removed.

A results folder is known by ``.vtgtsam/files.json``, which lists what was made in it. A name is listed before
the file is written, so the list is right whenever the process is killed. A folder of an older version has no
list; there a file counts as made here where its content says so (``recognised``).
"""

from __future__ import annotations

import contextlib
import json
import re
from collections.abc import Iterable
from pathlib import Path, PurePosixPath

from ..atomic import LEFTOVER, write_text
from ..exceptions import VtgtsamError
from .recognised import recognised

MARK = ".vtgtsam"
_LIST = "files.json"
_ABOUT = "Made by vtgtsam in this folder. It replaces and removes these files and no others."
_TEMPORARY = re.compile(rf"\.(.+)\.\d+{re.escape(LEFTOVER)}", re.DOTALL)


def prepare(out: Path, force: bool = False) -> None:
    """Make ``out`` a results folder, unless it is one.

    Args:
        out: The run's folder.
        force: Whether to use a folder that is neither empty nor a results folder.

    Raises:
        VtgtsamError: It is a file, or such a folder and ``force`` is not given.
    """
    if out.exists() and not out.is_dir():
        raise VtgtsamError(f"{out} is a file; results need a folder")
    out.mkdir(parents=True, exist_ok=True)
    try:
        listed = _listed(out)
    except VtgtsamError:
        if not force:
            raise
        listed = None
    if listed is not None:
        return
    others = sorted(path.name for path in out.iterdir() if path.name != MARK)
    if others and not force:
        more = ", ..." if len(others) > 3 else ""
        raise VtgtsamError(
            f"{out} holds {', '.join(others[:3])}{more} and was not made by vtgtsam, or by an older version; "
            "give an empty folder, or --force to use this one, which leaves all files alone that vtgtsam did not make"
        )
    _write(out, recognised(out) if others else set())


def made(out: Path) -> set[str]:
    """Files made here, as paths below ``out`` with "/"; some may have been removed since.

    Raises:
        VtgtsamError: The list is damaged.
    """
    listed = _listed(out)
    return recognised(out) if listed is None else listed


def check(out: Path, names: Iterable[str]) -> None:
    """Refuse to write files in the place of other people's.

    Raises:
        VtgtsamError: One of them is there and was not made here, or lies outside through a link.
    """
    _check(out, names, made(out))


def claim(out: Path, names: Iterable[str]) -> None:
    """List files before they are written.

    Raises:
        VtgtsamError: As ``check``.
    """
    names, known = set(names), made(out)
    _check(out, names, known)
    if not names <= known or not (out / MARK / _LIST).is_file():
        _write(out, known | names)


def release(out: Path, names: Iterable[str]) -> None:
    """Remove those of the files that were made here, and the folders that get empty by it."""
    known = made(out)
    mine = known.intersection(names)
    for name in sorted(mine):
        _check(out, [name], known)
        (out / name).unlink(missing_ok=True)
    for folder in sorted({above for name in mine for above in _above(name)}, reverse=True):
        with contextlib.suppress(OSError):  # it holds something else
            (out / folder).rmdir()
    if mine:
        _write(out, known - mine)


def release_below(out: Path, *folders: str) -> None:
    """As ``release``, of all that was made below these folders."""
    release(out, [name for name in made(out) if PurePosixPath(name).parts[0] in folders])


def settle(out: Path) -> None:
    """Take from the list what is not there, so that it does not tell how often the work was interrupted."""
    known = made(out)
    there = {name for name in known if (out / name).exists()}
    if there != known:
        _write(out, there)


def remove_leftovers(out: Path) -> None:
    """Remove the temporary files of a run that was killed."""
    known = {*made(out), f"{MARK}/{_LIST}"}
    for folder in {PurePosixPath(name).parent for name in known}:
        if not (out / folder).is_dir():
            continue
        for path in list((out / folder).iterdir()):
            part = _TEMPORARY.fullmatch(path.name)
            if part and str(folder / part[1]) in known:
                path.unlink(missing_ok=True)


def _check(out: Path, names: Iterable[str], known: set[str]) -> None:
    inside = out.resolve()
    for name in sorted(names):
        path = out / name
        if name not in known and (path.exists() or path.is_symlink()):
            raise VtgtsamError(
                f"{path} is in the way and was not made by vtgtsam; move it elsewhere, or give another folder"
            )
        if not path.parent.resolve().is_relative_to(inside):
            raise VtgtsamError(
                f"{path.parent} leads out of {out} through a link; give a folder without it"
            )


def _above(name: str) -> list[str]:
    """The folders a file lies in, below the run's folder."""
    return [str(folder) for folder in PurePosixPath(name).parents if folder.name]


def _listed(out: Path) -> set[str] | None:
    """What the list names, or None where there is no list."""
    path = out / MARK / _LIST
    try:
        names = json.loads(path.read_bytes())["files"]
        if isinstance(names, list) and all(map(_is_below, names)):
            return set(names)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (ValueError, KeyError, TypeError, RecursionError):
        pass
    raise VtgtsamError(
        f"{path}, the list of the files that vtgtsam made in {out}, is damaged; give another folder, or --force, "
        "which leaves all files alone whose content does not show that vtgtsam made them"
    )


def _is_below(name: object) -> bool:
    """Whether it names a file below the folder, and none that a list from elsewhere could harm."""
    if not isinstance(name, str) or not name or "\0" in name:
        return False
    path = PurePosixPath(name)
    return not path.is_absolute() and ".." not in path.parts and str(path) == name != "."


def _write(out: Path, names: set[str]) -> None:
    text = json.dumps({"about": _ABOUT, "files": sorted(names)}, indent=1)
    write_text(out / MARK / _LIST, text + "\n")
