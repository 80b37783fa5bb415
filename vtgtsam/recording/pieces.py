# SPDX-License-Identifier: MIT
"""Which files of a folder are one bag: what its metadata.yaml lists, or the pieces that rosbag2 cut it into."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from ..exceptions import RecordingError
from ..input.text import read_yaml
from . import names
from .magic import kind_of
from .mcap_file import McapFile

METADATA = "metadata.yaml"
STORED = (".mcap", ".db3")  # what rosbag2 calls its files
MOST_BETWEEN_NS = 2 * 10**9  # [ns], from the end of one piece to the begin of the next
MOST_OVER_NS = 10**8  # [ns], that two pieces may overlap by messages that came late


@dataclass(frozen=True)
class Listed:
    """What a rosbag2 folder's metadata.yaml says.

    Attributes:
        files: The bag's files, in their order.
        missing: Names of those that are not there.
        compressed: How it is compressed beyond what the files say themselves: "", "file" or "message".
        distribution: The ROS distribution it was recorded with, "" where that is not said.
    """

    files: list[Path]
    missing: list[str]
    compressed: str
    distribution: str


def read_listed(folder: Path) -> Listed:
    """Read a folder's metadata.yaml.

    Raises:
        RecordingError: It makes no sense, or none of the files that it lists is there.
    """
    path = folder / METADATA
    try:
        about: dict[str, Any] = read_yaml(path, RecordingError)["rosbag2_bagfile_information"]
        listed = [PurePosixPath(name).name for name in about["relative_file_paths"]]
    except (RecordingError, KeyError, TypeError) as error:
        detail = " ".join(f"{type(error).__name__}: {error}".split())
        raise RecordingError(
            f"{path} is no description of a rosbag2 bag ({detail}); remove it, or type: ros2 bag reindex "
            f"{folder}"
        ) from None
    there = [folder / name for name in listed if (folder / name).is_file()]
    missing = [name for name in listed if not (folder / name).is_file()]
    if not there:
        raise RecordingError(
            f"{path} lists {', '.join(listed) or 'no file'}, which is not there; copy the whole folder, or "
            f"type: ros2 bag reindex {folder}"
        )
    compressed = str(about.get("compression_mode") or "").lower()
    compressed = compressed if compressed in ("file", "message") else ""
    return Listed(there, missing, compressed, str(about.get("ros_distro") or ""))


def unlisted(folder: Path) -> list[Path]:
    """The pieces of the one bag in a folder without metadata.yaml, in their order; empty where there is none.

    Raises:
        RecordingError: The folder holds several recordings.
    """
    files = sorted(f for f in folder.iterdir() if f.suffix in STORED and f.is_file())
    if len(files) < 2 or are_pieces(files):
        return sorted(files, key=_number)
    shown = ", ".join(f.name for f in files[:3]) + (", ..." if len(files) > 3 else "")
    raise RecordingError(
        f"{folder} holds {len(files)} recordings ({shown}); give one of them. Pieces of one bag need its "
        f"{METADATA} or names NAME_0, NAME_1, ... and times that follow each other"
    )


def are_pieces(files: list[Path]) -> bool:
    """Whether files are one bag that rosbag2 cut: NAME_0, NAME_1, ... with times that follow each other.

    Recordings of this package are complete, whatever they are called.
    """
    numbered = {_number(file) for file in files}
    stems = {re.sub(r"_\d+$", "", file.stem) + file.suffix for file in files}
    if len(stems) > 1 or numbered != set(range(min(numbered), min(numbered) + len(files))):
        return False
    if min(numbered) < 0:
        return False
    end: int | None = None
    for file in sorted(files, key=_number):
        span = _span(file)
        if span is None or (
            end is not None and not -MOST_OVER_NS <= span[0] - end <= MOST_BETWEEN_NS
        ):
            return False
        end = span[1]
    return True


def pieces_among(files: list[Path]) -> list[Path]:
    """The pieces of a bag among other files, of the first such bag; empty where there is none."""
    by_stem: dict[str, list[Path]] = {}
    for file in files:
        if _number(file) >= 0:
            by_stem.setdefault(re.sub(r"_\d+$", "", file.stem) + file.suffix, []).append(file)
    return next((some for some in by_stem.values() if len(some) > 1 and are_pieces(some)), [])


def _number(file: Path) -> int:
    """The piece's number; -1 where it has none."""
    number = re.search(r"_(\d+)$", file.stem)
    return int(number[1]) if number else -1


def _span(file: Path) -> tuple[int, int] | None:
    """When a piece's messages were received [ns]; None where it has none or is no piece."""
    if kind_of(file) == "sqlite":
        from .bags import RosBag

        received = [message.receive_ns for message in RosBag(file).messages()]
        return (min(received), max(received)) if received else None
    piece = McapFile(file)
    span = piece.span()
    return None if names.METADATA in piece.metadata else span
