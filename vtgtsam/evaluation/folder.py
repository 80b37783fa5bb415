# SPDX-License-Identifier: MIT
"""Whose a results folder is, and which of its files an evaluation made: no other is ever replaced or removed.

A results folder is known by ``.vtgtsam/files.json``, which lists what was made in it. A name is listed before
the file is written, so the list is right whenever the process is killed. A folder of an older version has no
list; there a file counts as made here where its content says so (``recognised``). Files that later steps build
on are sealed: the list then has their digest, by which damage is noticed.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath

from ..atomic import LEFTOVER, write_text
from ..exceptions import VtgtsamError
from .lock import locked
from .recognised import recognised
from .store import MARK

_LIST = "files.json"
_LOCK = "lock"
_ABOUT = "Made by vtgtsam in this folder. It replaces and removes these files and no others."
_TEMPORARY = re.compile(rf"\.(.+)\.\d+{re.escape(LEFTOVER)}", re.DOTALL)


@contextlib.contextmanager
def in_use(out: Path, force: bool = False) -> Iterator[None]:
    """Make ``out`` a results folder, unless it is one, and keep other calls out of it.

    Args:
        out: The run's folder.
        force: Whether to use a folder that is neither empty nor a results folder.

    Raises:
        VtgtsamError: It is a file, or such a folder and ``force`` is not given; or another call works in it.
    """
    if out.exists() and not out.is_dir():
        raise VtgtsamError(f"{out} is a file; results need a folder")
    if not force:
        _refuse_others(out)
    with locked(out / MARK / _LOCK, str(out)):
        try:
            listed = _listed(out)
        except VtgtsamError:
            if not force:
                raise
            listed = None
        if listed is None:
            _write(out, dict.fromkeys(recognised(out)))
        yield


def _refuse_others(out: Path) -> None:
    others = (
        sorted(path.name for path in out.iterdir() if path.name != MARK) if out.exists() else []
    )
    if others and _listed(out) is None:
        more = ", ..." if len(others) > 3 else ""
        raise VtgtsamError(
            f"{out} holds {', '.join(others[:3])}{more} and was not made by vtgtsam, or by an older version; "
            "give an empty folder, or --force to use this one, which leaves all files alone that vtgtsam did not make"
        )


def made(out: Path) -> set[str]:
    """Files made here, as paths below ``out`` with "/"; some may have been removed since.

    Raises:
        VtgtsamError: The list is damaged.
    """
    return set(_made(out))


def seal(out: Path, names: Iterable[str]) -> None:
    """Keep what these files are now."""
    _write(out, _made(out) | {name: _sha256(out / name) for name in names})


def verify(out: Path, names: Iterable[str]) -> None:
    """Refuse files that are not what was sealed; one that never was passes.

    Raises:
        VtgtsamError: One is damaged, or was edited.
    """
    sealed = _made(out)
    for name in names:
        digest = sealed.get(name)
        if digest is not None and digest != _sha256(out / name):
            raise VtgtsamError(
                f"{out / name} is not what vtgtsam wrote: it is damaged, or was edited; "
                "`vtgtsam evaluate` with the same recordings makes it again from what is stored"
            )


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
    names, known = list(names), _made(out)
    _check(out, names, known)
    _write(out, known | dict.fromkeys(names))


def release(out: Path, names: Iterable[str]) -> None:
    """Remove those of the files that were made here, and the folders that get empty by it."""
    known = _made(out)
    mine = known.keys() & set(names)
    for name in sorted(mine):
        _check(out, [name], known)
        (out / name).unlink(missing_ok=True)
    for folder in sorted({above for name in mine for above in _above(name)}, reverse=True):
        with contextlib.suppress(OSError):  # it holds something else
            (out / folder).rmdir()
    if mine:
        _write(out, {name: known[name] for name in known.keys() - mine})


def release_below(out: Path, *folders: str) -> None:
    """As ``release``, of all that was made below these folders."""
    release(out, [name for name in made(out) if PurePosixPath(name).parts[0] in folders])


def settle(out: Path) -> None:
    """Take from the list what is not there, so that it does not tell how often the work was interrupted."""
    _write(out, {name: digest for name, digest in _made(out).items() if (out / name).exists()})


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


def _check(out: Path, names: Iterable[str], known: Collection[str]) -> None:
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


def _made(out: Path) -> dict[str, str | None]:
    """Files made here, and the digests of those that are sealed."""
    listed = _listed(out)
    return dict.fromkeys(recognised(out)) if listed is None else listed


def _listed(out: Path) -> dict[str, str | None] | None:
    """What the list says, or None where there is no list."""
    path = out / MARK / _LIST
    try:
        files = json.loads(path.read_bytes())["files"]
        digests = (str, type(None))
        if all(_is_below(name) and isinstance(files[name], digests) for name in files):
            return dict(files)
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


def _write(out: Path, files: Mapping[str, str | None]) -> None:
    text = json.dumps({"about": _ABOUT, "files": dict(sorted(files.items()))}, indent=1)
    write_text(out / MARK / _LIST, text + "\n")


def _sha256(path: Path) -> str | None:
    """A file's digest, or None where there is none."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except FileNotFoundError:
        return None
