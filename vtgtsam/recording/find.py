# SPDX-License-Identifier: MIT
"""Which recordings lie below a path: the same for every command."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from ..exceptions import RecordingError
from .pieces import METADATA, STORED, are_pieces, pieces_among


def recordings_below(path: Path) -> Iterator[tuple[str, Path]]:
    """Each recording with its path below the given one, "/" as "__"; its own name where it is one.

    Raises:
        RecordingError: The path does not exist, or holds no recording.
    """
    if not path.exists():
        raise RecordingError(f"{path} does not exist")
    if path.is_file() or is_bag(path):
        yield path.resolve().name, path
        return
    recordings = list(_search(path))
    if not recordings:
        raise RecordingError(
            f"no recordings in {path}; expected .mcap files or rosbag2 folders below it"
        )
    for recording in recordings:
        yield "__".join(recording.relative_to(path).parts), recording


def is_bag(folder: Path) -> bool:
    """Whether a folder is one recording: it says so, or holds nothing but the pieces of one."""
    if (folder / METADATA).is_file():
        return True
    stored = [file for file in folder.iterdir() if file.suffix in STORED and file.is_file()]
    return len(stored) > 1 and are_pieces(stored)


def _search(folder: Path, above: tuple[Path, ...] = ()) -> Iterator[Path]:
    above = (*above, folder.resolve())
    loose = [file for file in sorted(folder.iterdir()) if file.suffix == ".mcap" and file.is_file()]
    pieces = pieces_among(loose)
    if pieces:
        raise RecordingError(
            f"{', '.join(file.name for file in pieces)} in {folder} are pieces of one bag and lie beside "
            "other recordings; put them into a folder of their own"
        )
    for child in sorted(folder.iterdir()):
        if child.is_dir():
            if is_bag(child):
                yield child
            elif child.resolve() not in above:  # no link back up
                yield from _search(child, above)
        elif child.suffix == ".mcap":
            yield child
