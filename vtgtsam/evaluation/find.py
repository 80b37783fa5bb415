# SPDX-License-Identifier: MIT
"""Which recordings lie under the given paths, and what each is called."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TypeVar

from ..exceptions import RecordingError
from ..recording.find import recordings_below
from .remote import RemoteRecording, find_remote, is_url

Found = TypeVar("Found", bound=Path | RemoteRecording)


def find_recordings(paths: Iterable[str | os.PathLike[str]]) -> dict[str, Path]:
    """Recordings by sequence id, in the ids' order.

    A path is an ``.mcap`` file, a rosbag2 folder (it holds a ``metadata.yaml``, or the pieces of one bag), or
    a folder that is searched for both. The id is the path below the given folder, without ``.mcap`` and with
    "/" as "__".

    Raises:
        RecordingError: A path does not exist or holds no recording, or two recordings get one id.
    """
    return _by_id(pair for path in paths for pair in _below(Path(path)))


def find_anywhere(
    paths: Iterable[str | os.PathLike[str]],
) -> dict[str, Path | RemoteRecording]:
    """As ``find_recordings``; a path may be a URL as well, such as "s3://bucket/folder".

    Raises:
        RecordingError: As there, or a store cannot be listed.
    """
    return _by_id(pair for path in paths for pair in _at(path))


def _by_id(pairs: Iterable[tuple[str, Found]]) -> dict[str, Found]:
    found: dict[str, Found] = {}
    for sequence, recording in pairs:
        known = found.setdefault(sequence, recording)
        if known.resolve() != recording.resolve():
            raise RecordingError(
                f"two recordings have the id {sequence!r}: {known} and {recording}; "
                "give a folder above both instead, or evaluate them apart"
            )
    if not found:
        raise RecordingError(
            "no recordings given; name .mcap files, rosbag2 folders, or folders of them"
        )
    return dict(sorted(found.items()))


def _at(path: str | os.PathLike[str]) -> Iterator[tuple[str, Path | RemoteRecording]]:
    if not is_url(path):
        yield from _below(Path(path))
        return
    for below, recording in find_remote(str(path)):
        yield _without_suffix(below.replace("/", "__")), recording


def _below(path: Path) -> Iterator[tuple[str, Path]]:
    for name, recording in recordings_below(path):
        yield _without_suffix(name), recording


def _without_suffix(name: str) -> str:
    return name.removesuffix(".mcap")
