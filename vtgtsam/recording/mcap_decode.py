# SPDX-License-Identifier: MIT
"""From the bytes of a channel's messages to messages: by the definition in the file, else by a known one."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import zstandard
from mcap.records import Channel, Schema

from ..exceptions import RecordingError
from ..extras import require
from .messages import decoder, is_known

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

MOST_BYTES = 2**28  # of one message, unpacked
_ZSTD = b"\x28\xb5\x2f\xfd"  # no message begins like this: CDR begins with 0

Decode = Callable[[bytes], Any]


class Decoder:
    """Decodes a channel's messages; what it cannot, it says when it is asked."""

    def __init__(self, channel: Channel, schema: Schema | None) -> None:
        self.topic = channel.topic
        self.encoding = channel.message_encoding
        self.schema = schema
        self.msgtype = "" if schema is None else _full_name(schema.name)
        self._decode: Decode | None = None

    def __call__(self, data: bytes) -> Any:
        """The message of these bytes."""
        if self._decode is None:  # only now: a topic that nobody needs may be of any kind
            self._decode = self._find()
        if data.startswith(_ZSTD):  # rosbag2 with --compression-mode message
            data = zstandard.ZstdDecompressor().decompress(data, max_output_size=MOST_BYTES)
        return self._decode(data)

    def _find(self) -> Decode:
        schema = self.schema
        if schema is None:
            raise RecordingError(
                f"topic {self.topic} has no type in the file; record it again, with the message packages at hand"
            )
        if self.encoding == "ros1":
            return self._by_rosbags(ros=1)
        if self.encoding != "cdr":
            raise RecordingError(
                f"topic {self.topic} has messages encoded as {self.encoding!r}, expected ROS 2 "
                "messages ('cdr') or ROS 1's ('ros1')"
            )
        if schema.encoding == "ros2msg" and schema.data:
            return decoder(schema.name, schema.data.decode())
        if is_known(self.msgtype):
            return decoder(self.msgtype)
        return self._by_rosbags(ros=2)

    def _by_rosbags(self, ros: int) -> Decode:
        """By the rosbags library, which knows ROS 1, IDL, and the types that come with ROS."""
        require(
            "recordings", f"topic {self.topic} ({self.msgtype}, {self.encoding}) needs", "rosbags"
        )
        from rosbags.typesys import Stores, get_typestore

        store = get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_HUMBLE)
        try:
            self._register(store)
        except Exception as error:  # a definition may say anything
            raise RecordingError(
                f"topic {self.topic} has type {self.msgtype}, whose definition is not understood "
                f"({' '.join(str(error).split())})"
            ) from error
        if self.msgtype not in store.fielddefs:
            raise RecordingError(
                f"topic {self.topic} has type {self.msgtype} without a definition; record it again with one"
            )
        deserialize = store.deserialize_ros1 if ros == 1 else store.deserialize_cdr
        return partial(deserialize, typename=self.msgtype)

    def _register(self, store: Typestore) -> None:
        """Teach the type store what the file says of the type."""
        from rosbags.typesys import get_types_from_idl, get_types_from_msg

        assert self.schema is not None
        text = self.schema.data.decode()
        if not text.strip():
            return
        if self.schema.encoding == "ros2idl":
            for part in text.split("=" * 80 + "\n"):
                store.register(
                    get_types_from_idl(part.split("\n", 1)[1] if part.startswith("IDL: ") else part)
                )
        else:
            store.register(get_types_from_msg(text, self.msgtype))


def _full_name(name: str) -> str:
    """A type's name with "msg" in the middle, which ROS 1 leaves out."""
    package, _, rest = name.partition("/")
    return f"{package}/msg/{rest}" if rest and "/" not in rest else name
