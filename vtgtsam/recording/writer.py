# SPDX-License-Identifier: MIT
"""Write a sequence as an MCAP file with ROS 2 messages."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import gtsam
import numpy as np
from mcap.writer import Writer

from .. import __version__
from ..atomic import naming
from . import messages, names
from .calibrations import text_of_change
from .covariance import ros_from_tangent
from .images import encode_color, encode_depth

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..calibration.calibration import Calibration
    from ..camera import CameraIntrinsics

MAX_CHUNK_BYTES = 64 * 1024
MAX_CHUNK_NS = 10**9
_RECORD_OVERHEAD = 64  # [bytes], above what an MCAP record has around its texts or message
MAX_STAMP = 2**31  # [s], a ROS stamp has a signed 32 bit number of seconds

Seconds = float | Fraction


class RecordingWriter:
    """Writer of one sequence; use it in a ``with`` statement.

    Metadata and attachments are written first, and what was recorded goes to the operating system
    in pieces of at most 64 KiB (or one larger image) or 1 s, so that a program that crashes leaves a
    usable file that lacks its last second at most. The same calls give the same bytes.

    Every method takes the instant ``time`` [s] that its values belong to, which becomes the header's
    stamp, and ``received`` [s], when they became known, which becomes the log time (``time`` where it is not
    given). Instants may come in any order, the calls from one thread at a time. A ``Fraction`` keeps the
    nanoseconds of an instant that counts from 1970; a float's steps are 0.2 us there.
    """

    def __init__(
        self,
        path: str | Path,
        metadata: Mapping[str, str] | None = None,
        *,
        hand_xml: str | None = None,
        mesh: bytes | None = None,
        mesh_suffix: str = ".obj",
        calibration: Calibration | None = None,
    ) -> None:
        """Create the file.

        Args:
            path: The file to write; an existing one is replaced.
            metadata: What the ``vtgtsam`` record says (hand, object, object_scale, ...). The
                version is added.
            hand_xml: The hand's MJCF or URDF, complete in itself.
            mesh: The object's mesh file, byte for byte.
            mesh_suffix: That file's suffix, such as ".obj", ".stl" or ".ply".
            calibration: The calibration that a live run begins with. What is recorded stays uncorrected.
        """
        entries = {"version": __version__, **(metadata or {})}
        wrong = [key for key, value in entries.items() if not isinstance(value, str)]
        if wrong:
            raise ValueError(f"metadata must be strings, these are not: {', '.join(wrong)}")
        self.path = Path(path)
        self._schemas: dict[str, int] = {}  # by type
        self._channels: dict[str, int] = {}  # by topic
        self._types: dict[str, str] = {}  # by topic
        self._counts: Counter[str] = Counter()
        self._chunk_bytes = 0
        self._chunk_start: int | None = None
        self._file = self.path.open("wb")
        # The library would close a chunk only after it has grown too large; see _begin_chunk.
        self._mcap = Writer(self._file, chunk_size=2**40, enable_data_crcs=True)
        self._mcap.start(profile="ros2", library=f"vtgtsam {__version__}")
        self._mcap.add_metadata(names.METADATA, entries)
        if hand_xml is not None:
            suffix = ".urdf" if "<robot" in hand_xml else ".xml"
            self._attach(names.HAND_ATTACHMENT + suffix, "application/xml", hand_xml.encode())
        if mesh is not None:
            self._attach(names.OBJECT_ATTACHMENT + mesh_suffix, "application/octet-stream", mesh)
        if calibration is not None:
            text = calibration.text().encode()
            self._attach(names.CALIBRATION_ATTACHMENT, "application/yaml", text)
        self._mcap.flush()  # type: ignore[no-untyped-call]

    def joint_states(
        self,
        time: Seconds,
        joint_names: Sequence[str],
        joints: ArrayLike,
        received: Seconds | None = None,
    ) -> None:
        """Joint angles [rad], shape (J,), of the named joints."""
        position = _finite("joint angles", joints, (len(joint_names),))
        self._write(
            names.JOINTS,
            messages.JOINT_STATE,
            time,
            "",
            {"name": list(joint_names), "position": position.tolist()},
            received,
        )

    def tactile(
        self,
        time: Seconds,
        pad_names: Sequence[str],
        pressure: ArrayLike,
        contacts: ArrayLike,
        received: Seconds | None = None,
    ) -> None:
        """Pressure (fraction of 6 N) and contact bit of the named pads, each of shape (K,)."""
        pressure = _finite("pressure", pressure, (len(pad_names),))
        bits = np.asarray(contacts, dtype=bool)
        if bits.shape != pressure.shape:
            raise ValueError(f"contacts must have shape {pressure.shape}, got {bits.shape}")
        fields = {"name": list(pad_names), "pressure": pressure.tolist(), "contact": bits.tolist()}
        self._write(names.CONTACTS, messages.TACTILE_PADS, time, "", fields, received)

    def hand_pose(self, time: Seconds, T_wh: gtsam.Pose3, received: Seconds | None = None) -> None:
        """Pose of the hand's root frame in the world."""
        self._write_pose(names.HAND_POSE, time, T_wh, received)

    def object_pose(
        self,
        time: Seconds,
        T_wo: gtsam.Pose3,
        covariance: np.ndarray | None = None,
        received: Seconds | None = None,
    ) -> None:
        """The object's pose as the visual tracker reports it.

        Args:
            time: Instant of the image it was seen in [s].
            T_wo: The pose.
            covariance: Its covariance, right perturbation, rotation first, shape (6, 6). Whether a
                recording has covariances is decided by its first pose.
            received: When the tracker had found it [s].
        """
        topic = names.VISION
        has_covariances = self._types.get(topic) == messages.POSE_WITH_COVARIANCE
        if covariance is None and not has_covariances:
            self._write_pose(topic, time, T_wo, received)
            return
        if self._types.get(topic) == messages.POSE:
            raise ValueError(
                "the first visual pose of this recording came without covariance, "
                "so that later ones cannot have one; give all or none"
            )
        ros = np.zeros((6, 6))  # all zeros: unknown
        if covariance is not None:
            ros = ros_from_tangent(_finite("covariance", covariance, (6, 6)), T_wo.rotation())
        pose = {"pose": _checked_fields(T_wo), "covariance": ros.ravel().tolist()}
        self._write(topic, messages.POSE_WITH_COVARIANCE, time, "world", {"pose": pose}, received)

    def vision_correlation(
        self, time: Seconds, correlation: float, received: Seconds | None = None
    ) -> None:
        """How long the errors of the visual pose of that instant stay alike with those of others [s]."""
        if not 0.0 <= correlation < math.inf:
            raise ValueError(f"correlation must be seconds, at least 0, got {correlation!r}")
        fields = {"seconds": float(correlation)}
        kind = messages.CORRELATION_TIME
        self._write(names.VISION_CORRELATION, kind, time, "", fields, received)

    def truth(self, time: Seconds, T_wo: gtsam.Pose3, received: Seconds | None = None) -> None:
        """The object's true pose."""
        self._write_pose(names.TRUTH, time, T_wo, received)

    def estimate(self, time: Seconds, T_wo: gtsam.Pose3, received: Seconds | None = None) -> None:
        """The object's pose as a live run estimated it at the instant it fused."""
        self._write_pose(names.ESTIMATE, time, T_wo, received)

    def calibration(
        self, time: Seconds, calibration: Calibration, received: Seconds | None = None
    ) -> None:
        """The calibration that a live run goes on with, from the frame of that instant on."""
        fields = {"data": text_of_change(float(time), calibration)}
        self._write_fields(names.CALIBRATION, messages.STRING, time, fields, received)

    def camera_pose(
        self, time: Seconds, T_wc: gtsam.Pose3, received: Seconds | None = None
    ) -> None:
        """Pose of the camera in the world: x right, y down, z forward."""
        self._write_pose(names.CAMERA_POSE, time, T_wc, received)

    def camera_info(
        self, time: Seconds, intrinsics: CameraIntrinsics, received: Seconds | None = None
    ) -> None:
        """The camera's intrinsics; its images have no distortion."""
        i = intrinsics
        fields = {
            "height": i.height,
            "width": i.width,
            "distortion_model": "plumb_bob",
            "d": [0.0] * 5,
            "k": [i.fx, 0.0, i.cx, 0.0, i.fy, i.cy, 0.0, 0.0, 1.0],
            "r": np.eye(3).ravel().tolist(),
            "p": [i.fx, 0.0, i.cx, 0.0, 0.0, i.fy, i.cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        }
        self._write(names.CAMERA_INFO, messages.CAMERA_INFO, time, "camera", fields, received)

    def depth(self, time: Seconds, depth: np.ndarray, received: Seconds | None = None) -> None:
        """Depth image [m], shape (H, W), stored in whole millimetres as a 16 bit PNG.

        Pixels that are not finite, not positive or beyond 65.535 m are stored as 0, no depth.
        """
        self._write_image(names.DEPTH, time, "png", encode_depth(depth), received)

    def color(self, time: Seconds, image: np.ndarray, received: Seconds | None = None) -> None:
        """Colour image, RGB, uint8, shape (H, W, 3), stored as JPEG."""
        self._write_image(names.COLOR, time, "jpeg", encode_color(image), received)

    def close(self) -> None:
        """Write what is pending and the index, and close the file."""
        if self._file.closed:
            return
        with naming(self.path):
            try:
                self._mcap.finish()  # type: ignore[no-untyped-call]
            finally:
                self._file.close()

    def __enter__(self) -> RecordingWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _write_pose(
        self, topic: str, time: Seconds, pose: gtsam.Pose3, received: Seconds | None
    ) -> None:
        self._write(topic, messages.POSE, time, "world", {"pose": _checked_fields(pose)}, received)

    def _write_image(
        self, topic: str, time: Seconds, image_format: str, data: bytes, received: Seconds | None
    ) -> None:
        fields = {"format": image_format, "data": data}
        self._write(topic, messages.COMPRESSED_IMAGE, time, "camera", fields, received)

    def _write(
        self,
        topic: str,
        msgtype: str,
        time: Seconds,
        frame: str,
        fields: dict[str, Any],
        received: Seconds | None = None,
    ) -> None:
        stamp = _nanoseconds("time", time)
        fields = {"header": messages.header(stamp, frame), **fields}
        self._write_fields(topic, msgtype, time, fields, received)

    def _write_fields(
        self,
        topic: str,
        msgtype: str,
        time: Seconds,
        fields: dict[str, Any],
        received: Seconds | None,
    ) -> None:
        stamp = _nanoseconds("time", time)
        known = stamp if received is None else _nanoseconds("received", received)
        data = messages.encoder(msgtype)(fields)
        size = len(data) + _RECORD_OVERHEAD
        if topic not in self._channels:  # its definition goes into the same chunk
            size += len(messages.definition(msgtype).encode()) + 2 * _RECORD_OVERHEAD + len(topic)
        self._begin_chunk(known, size)
        self._counts[topic] += 1
        channel = self._channel(topic, msgtype)
        self._mcap.add_message(channel, known, data, known, sequence=self._counts[topic])

    def _begin_chunk(self, stamp: int, size: int) -> None:
        """Flush the pending chunk if a message of this stamp and size has no room in it."""
        if self._chunk_start is not None and (
            self._chunk_bytes + size > MAX_CHUNK_BYTES
            or abs(stamp - self._chunk_start) >= MAX_CHUNK_NS
        ):
            with naming(self.path):
                self._mcap.flush()  # type: ignore[no-untyped-call]
            self._chunk_start = None
        if self._chunk_start is None:
            self._chunk_start, self._chunk_bytes = stamp, 0
        self._chunk_bytes += size

    def _channel(self, topic: str, msgtype: str) -> int:
        if topic not in self._channels:
            if msgtype not in self._schemas:
                text = messages.definition(msgtype).encode()
                self._schemas[msgtype] = self._mcap.register_schema(msgtype, "ros2msg", text)
            channel = self._mcap.register_channel(topic, "cdr", self._schemas[msgtype])
            self._channels[topic], self._types[topic] = channel, msgtype
        return self._channels[topic]

    def _attach(self, name: str, media_type: str, data: bytes) -> None:
        self._mcap.add_attachment(0, 0, name, media_type, data)


def _nanoseconds(what: str, seconds: Seconds) -> int:
    if not (math.isfinite(seconds) and 0 <= seconds < MAX_STAMP):
        raise ValueError(f"{what} must be seconds from 0 to {MAX_STAMP}, got {seconds!r}")
    return round(seconds * 10**9)


def _finite(what: str, values: ArrayLike, shape: tuple[int, ...]) -> np.ndarray:
    array = np.asarray(values, dtype=np.float64)
    if array.shape != shape:
        raise ValueError(f"{what} must have shape {shape}, got {array.shape}")
    if not np.isfinite(array).all():
        raise ValueError(f"{what} must be finite, got {array}")
    return array


def _checked_fields(pose: gtsam.Pose3) -> dict[str, dict[str, float]]:
    _finite("a pose", pose.matrix(), (4, 4))
    return messages.pose_fields(pose)
