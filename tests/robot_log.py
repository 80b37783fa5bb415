# SPDX-License-Identifier: MIT
"""Logs as other people's robots write them: stamps, receipts, frames and bytes as a test wants them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import gtsam
import numpy as np
from held_box import HAND_XML, PADS, box_obj
from mcap.writer import CompressionType, Writer

from vtgtsam.recording import messages, names

JOINTS = tuple(f"j_{name}" for name in PADS)


class RobotLog:
    """An MCAP file with ROS 2 messages, in whatever order and state."""

    def __init__(self, path: Path, metadata: dict[str, str] | None = None, **options) -> None:
        options = {"compression": CompressionType.NONE} | options
        self._file = path.open("wb")
        self.writer = Writer(self._file, **options)
        self.writer.start(profile="ros2", library="a robot")
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        if metadata is not None:
            self.writer.add_metadata(names.METADATA, metadata)

    def __enter__(self) -> RobotLog:
        return self

    def __exit__(self, *_) -> None:
        self.writer.finish()
        self._file.close()

    def attach(self, name: str, data: bytes) -> None:
        self.writer.add_attachment(0, 0, name, "application/octet-stream", data)

    def channel(self, topic: str, msgtype: str, encoding="cdr", schema="ros2msg", text=None) -> int:
        if topic not in self._channels:
            if msgtype not in self._schemas:
                data = messages.definition(msgtype).encode() if text is None else text
                self._schemas[msgtype] = self.writer.register_schema(msgtype, schema, data)
            self._channels[topic] = self.writer.register_channel(
                topic, encoding, self._schemas[msgtype]
            )
        return self._channels[topic]

    def raw(self, topic: str, msgtype: str, data: bytes, received: float, **channel) -> None:
        stamp = round(received * 1e9)
        self.writer.add_message(self.channel(topic, msgtype, **channel), stamp, data, stamp)

    def message(self, topic, msgtype, t, fields, received=None, frame="world") -> None:
        header = messages.header(round(t * 1e9), frame)
        data = messages.encoder(msgtype)({"header": header, **fields})
        self.raw(topic, msgtype, data, t if received is None else received)

    def joints(self, t, values, joint_names: Sequence[str] = JOINTS, topic=names.JOINTS, **options):
        fields = {"name": list(joint_names), "position": list(map(float, values))}
        self.message(topic, messages.JOINT_STATE, t, fields, **options)

    def pads(self, t, bits, pad_names: Sequence[str] = PADS, topic=names.CONTACTS, **options):
        pressure = [float(bit) for bit in bits]
        fields = {"name": list(pad_names), "pressure": pressure, "contact": list(map(bool, bits))}
        self.message(topic, messages.TACTILE_PADS, t, fields, **options)

    def pose(self, topic, t, T, **options):
        self.message(topic, messages.POSE, t, {"pose": messages.pose_fields(T)}, **options)


def lifted(t: float) -> gtsam.Pose3:
    """The hand, and the box in it: still until 1 s, then lifted and turned until 2 s, then still."""
    share = 0.5 - 0.5 * np.cos(np.pi * np.clip(t - 1.0, 0.0, 1.0))
    return gtsam.Pose3(gtsam.Rot3.RzRyRx(0.3, share, 0.1), [0.4, 0.1, 0.2 + 0.2 * share])


def write_log(path: Path, change: Callable[[RobotLog, str, float, dict], None] | None = None):
    """A sound log of 3 s of the held box, at 50 Hz; ``change`` may write each message in its own way.

    Args:
        path: The file.
        change: Called with the log, a topic, the instant and what would be written, in place of it.
    """
    rng = np.random.default_rng(0)
    with RobotLog(path, {"object": "box", "hand": "clamp"}) as log:
        log.attach("hand.xml", HAND_XML.encode())
        log.attach("object.obj", box_obj())

        def write(topic: str, t: float, what: dict) -> None:
            if change is not None and change(log, topic, t, what) is not None:
                return
            send(log, topic, t, **what)

        for k in range(150):
            t = 100.0 + 0.02 * k
            jitter = gtsam.Pose3.Expmap(rng.normal(0, [5e-3] * 3 + [1e-3] * 3))
            write(names.JOINTS, t, {"values": rng.normal(0, 1e-4, 4)})
            write(names.CONTACTS, t, {"values": [1, 1, 1, 1]})
            write(names.HAND_POSE, t, {"values": lifted(t - 100)})
            write(names.TRUTH, t, {"values": lifted(t - 100)})
            write(names.VISION, t, {"values": lifted(t - 100) * jitter})
    return path


def send(log: RobotLog, topic: str, t: float, values, **options) -> bool:
    """Write one message of a stream; True, for ``change`` to return."""
    if topic == names.JOINTS:
        log.joints(t, values, **options)
    elif topic == names.CONTACTS:
        log.pads(t, values, **options)
    else:
        log.pose(topic, t, values, **options)
    return True
