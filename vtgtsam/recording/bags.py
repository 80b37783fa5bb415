# SPDX-License-Identifier: MIT
"""Open a recording: an MCAP file, a rosbag2 folder, or a ROS 1 bag."""

from __future__ import annotations

from collections.abc import Container, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from ..exceptions import RecordingError
from ..extras import require
from .magic import kind_of
from .mcap_file import McapFile
from .messages import CORRELATION_TIME, TACTILE_PADS, definition
from .pieces import METADATA, read_listed, unlisted
from .source import BagMessage, Source

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader
    from rosbags.interfaces import Connection


def open_source(path: str | Path) -> Source:
    """The bag at a path: of a file that file, of a folder what its metadata.yaml lists.

    Raises:
        RecordingError: There is nothing, or nothing that is a recording, or several.
    """
    path = Path(path)
    if not path.exists():
        raise RecordingError(f"{path} does not exist")
    if not path.is_dir():
        return _open_file(path)
    if (path / METADATA).is_file():
        return _open_listed(path)
    files = unlisted(path)
    if files:
        return Pieces(path, [_open_file(file) for file in files])
    raise RecordingError(
        f"{path} holds neither an .mcap file nor a rosbag2 metadata.yaml; give a recording"
    )


def _open_file(path: Path) -> Source:
    return McapFile(path) if kind_of(path) == "mcap" else RosBag(path)


def _open_listed(folder: Path) -> Source:
    listed = read_listed(folder)
    if listed.compressed and not listed.missing:
        return RosBag(folder)
    if listed.compressed:
        raise RecordingError(
            f"{folder / METADATA} lists {', '.join(listed.missing)}, which is not there; copy the whole "
            "folder"
        )
    warnings = [
        f"{METADATA} lists {name}, which is not there: what it held is missing"
        for name in listed.missing
    ]
    return Pieces(folder, [_open_file(file) for file in listed.files], warnings)


class Pieces:
    """A rosbag2 folder: one file, or several that the recorder cut it into."""

    def __init__(self, path: Path, sources: list[Source], warnings: Sequence[str] = ()) -> None:
        self.path = path
        self._sources = sources
        self._warnings = tuple(warnings)
        self.topics: dict[str, str] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, bytes] = {}
        self.warnings: list[str] = []

    def messages(self, topics: Container[str] | None = None) -> Iterator[BagMessage]:
        """Messages of all files, one file after the other."""
        self.warnings = list(self._warnings)
        for file in self._sources:
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
                reader = stack.enter_context(self._reader(stack.enter_context(_named(self.path))))
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
        elif not self.path.is_dir() and kind_of(self.path) == "ros1":
            why += (
                "; if it was cut off, as by a crash (.bag.active), type: rosbag reindex "
                f"{self.path.name}"
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

    def _reader(self, path: Path) -> AnyReader:
        require("recordings", f"{self.path} needs", "rosbags")
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        from .rosbags_limits import keep_limits

        keep_limits()
        # For bags of older ROS 2 versions, which hold no definitions.
        typestore = get_typestore(Stores.ROS2_HUMBLE)
        for own in (TACTILE_PADS, CORRELATION_TIME):
            typestore.register(get_types_from_msg(definition(own), own))
        return AnyReader([path], default_typestore=typestore)


@contextmanager
def _named(path: Path) -> Iterator[Path]:
    """The file under a name by which the rosbags library knows what it is."""
    suffix = "" if path.is_dir() else {"ros1": ".bag", "sqlite": ".db3"}.get(kind_of(path), "")
    if path.suffix == suffix or not suffix:
        yield path
        return
    with TemporaryDirectory(prefix="vtgtsam-") as folder:
        link = Path(folder) / f"bag{suffix}"
        link.symlink_to(path.resolve())
        yield link
