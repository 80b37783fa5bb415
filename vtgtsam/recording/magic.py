# SPDX-License-Identifier: MIT
"""What kind of file it is, by how it begins; its name may say anything."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from ..exceptions import RecordingError

Kind = Literal["mcap", "sqlite", "ros1"]

_BAGS: dict[bytes, Kind] = {
    b"\x89MCAP0\r\n": "mcap",
    b"SQLite format 3\0": "sqlite",
    b"#ROSBAG V2.0\n": "ros1",
}
_OTHERS = {
    b"\x28\xb5\x2f\xfd": "is compressed with zstd; type: zstd -d {name} (or give the rosbag2 folder it is in)",
    b"\x04\x22\x4d\x18": "is compressed with lz4; type: lz4 -d {name}",
    b"\x1f\x8b": "is compressed with gzip; type: gunzip {name}",
    b"PK\x03\x04": "is a zip archive; unpack it first",
    b"BZh": "is compressed with bzip2; type: bunzip2 {name}",
    b"version https://git-lfs": "is a pointer of Git LFS, not the file; type: git lfs pull",
    b"#ROSBAG V1": "is a bag of ROS 1 from before 2010; convert it with: rosbag fix",
}


def kind_of(path: Path) -> Kind:
    """Which kind of bag a file is.

    Raises:
        RecordingError: It is none; it says what it is and what to type.
    """
    with path.open("rb") as file:
        start = file.read(64)
    for magic, kind in _BAGS.items():
        if start.startswith(magic):
            return kind
    for magic, words in _OTHERS.items():
        if start.startswith(magic):
            raise RecordingError(f"{path} {words.format(name=path.name)}")
    what = "is empty" if not start else "is not a recording"
    if start and not any(start):
        what = "begins with zeros, as a file that was never written to disk"
    raise RecordingError(f"{path} {what}; expected an .mcap file, a rosbag2 folder or a ROS 1 .bag")
