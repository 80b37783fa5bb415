# SPDX-License-Identifier: MIT
"""Open a recording: an MCAP file, a rosbag2 folder, or a ROS 1 bag."""

from __future__ import annotations

import re
from collections.abc import Container, Iterator
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ..exceptions import RecordingError
from .mcap_file import McapFile
from .messages import TACTILE_PADS, definition
from .source import BagMessage, Source

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader
    from rosbags.interfaces import Connection


def open_source(path: str | Path) -> Source:
    """The bag at a path.

    Raises:
        RecordingError: There is nothing, or nothing that is a recording.
    """
    path = Path(path)
    if not path.exists():
        raise RecordingError(f"{path} does not exist")
    if path.is_dir():
        return _open_folder(path)
    if path.suffix == ".db3":  # the folder around it says what is in it
        return _open_folder(path.parent)
    return RosBag(path) if path.suffix == ".bag" else McapFile(path)


def _open_folder(path: Path) -> Source:
    files = sorted(path.glob("*.mcap"), key=_split_number)
    if files:
        return McapFolder(path, files)
    if (path / "metadata.yaml").is_file():
        return RosBag(path)
    raise RecordingError(
        f"{path} holds neither an .mcap file nor a rosbag2 metadata.yaml; give a recording"
    )


def _split_number(file: Path) -> tuple[int, str]:
    """Place of a file among the pieces of a split bag: name_2.mcap comes before name_10.mcap."""
    number = re.search(r"_(\d+)$", file.stem)
    return (int(number[1]) if number else 0, file.name)


class McapFolder:
    """A rosbag2 folder of MCAP files, which needs no metadata.yaml, as after a crash."""

    def __init__(self, path: Path, files: list[Path]) -> None:
        self.path = path
        self._files = [McapFile(file) for file in files]
        self.topics: dict[str, str] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, bytes] = {}
        self.warnings: list[str] = []

    def messages(self, topics: Container[str] | None = None) -> Iterator[BagMessage]:
        """Messages of all files, one file after the other."""
        self.warnings = []
        for file in self._files:
            yield from file.messages(topics)
            self.topics.update(file.topics)
            self.metadata.update(file.metadata)
            self.attachments.update(file.attachments)
            self.warnings += [f"{file.path.name}: {warning}" for warning in file.warnings]


class RosBag:
    """A rosbag2 folder (sqlite3, or compressed) or a ROS 1 bag, read by the rosbags library."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.topics: dict[str, str] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, bytes] = {}
        self.warnings: list[str] = []

    def messages(self, topics: Container[str] | None = None) -> Iterator[BagMessage]:
        """Messages in the order of their receipt."""
        self.warnings = []
        with ExitStack() as stack:
            try:
                reader = stack.enter_context(self._reader())
            except RecordingError:
                raise
            except Exception as error:  # rosbags passes on whatever its parsers and sqlite raise
                raise RecordingError(self._why_unread(error)) from error
            self.topics = {c.topic: c.msgtype for c in reader.connections}
            wanted = [c for c in reader.connections if topics is None or c.topic in topics]
            if wanted:
                yield from self._read(reader, wanted)

    def _why_unread(self, error: Exception) -> str:
        why = f"{self.path} is not a readable ROS bag: {error}"
        if "malformed" in str(error) or "not a database" in str(error):  # SQLite's words
            why += (
                "; if it is a copy that was cut off, copy it again; ROS bags in MCAP can be read even "
                "where they are cut off"
            )
        return why

    def _read(self, reader: AnyReader, wanted: list[Connection]) -> Iterator[BagMessage]:
        deserialize = (
            reader.typestore.deserialize_cdr if reader.is2 else reader.typestore.deserialize_ros1
        )
        receive_ns = 0
        try:
            for connection, receive_ns, data in reader.messages(wanted):
                decode = partial(deserialize, typename=connection.msgtype)
                yield BagMessage(connection.topic, connection.msgtype, receive_ns, data, decode)
        except Exception as error:  # as above; nothing of a caller's is raised in here
            self.warnings.append(
                f"the bag is damaged ({error}): what was recorded after "
                f"{receive_ns / 1e9:.2f} s is lost; the rest is used"
            )

    def _reader(self) -> AnyReader:
        try:
            from rosbags.highlevel import AnyReader
            from rosbags.typesys import Stores, get_types_from_msg, get_typestore
        except ImportError:
            raise RecordingError(
                f"{self.path} needs the rosbags library; type: pip install 'vtgtsam[bags]'"
            ) from None
        # For bags of older ROS 2 versions, which hold no definitions.
        typestore = get_typestore(Stores.ROS2_HUMBLE)
        typestore.register(get_types_from_msg(definition(TACTILE_PADS), TACTILE_PADS))
        return AnyReader([self.path], default_typestore=typestore)
