# SPDX-License-Identifier: MIT
"""ROS 2 messages of a recording: their definitions, their CDR bytes, and conversions to our types.

The definitions are the .msg files in ``msg/``, laid out as a ROS workspace has them. Decoded
messages are plain objects with the fields of the definition, whichever library decoded them.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Mapping
from contextlib import redirect_stderr
from functools import cache
from importlib import resources
from typing import Any

import gtsam
import numpy as np

# mcap-ros2-support offers the encoder only together with a file writer that cannot be flushed.
from mcap_ros2._dynamic import generate_dynamic, serialize_dynamic

JOINT_STATE = "sensor_msgs/msg/JointState"
TACTILE_PADS = "vtgtsam_msgs/msg/TactilePads"
CORRELATION_TIME = "vtgtsam_msgs/msg/CorrelationTime"
POSE = "geometry_msgs/msg/PoseStamped"
POSE_WITH_COVARIANCE = "geometry_msgs/msg/PoseWithCovarianceStamped"
COMPRESSED_IMAGE = "sensor_msgs/msg/CompressedImage"
STRING = "std_msgs/msg/String"
CAMERA_INFO = "sensor_msgs/msg/CameraInfo"

QUATERNION_TOLERANCE = 0.01  # |norm - 1| above which a quaternion is a mistake, as tf2 has it

_SEPARATOR = "=" * 80 + "\n"
_FIELD_TYPE = re.compile(r"^\s*(?P<type>[A-Za-z][\w/]*)(\[[^\]]*\])?\s+\w+", re.MULTILINE)


def _full_name(field_type: str, package: str) -> str | None:
    """Name of a field's message type, such as std_msgs/msg/Header; None where it is primitive."""
    if "/" in field_type:
        owner, _, name = field_type.partition("/")
        return f"{owner}/msg/{name}"
    return f"{package}/msg/{field_type}" if field_type[0].isupper() else None


def _own_text(msgtype: str) -> str:
    return resources.files(__package__).joinpath("msg", f"{msgtype}.msg").read_text()


@cache
def is_known(msgtype: str) -> bool:
    """Whether a message type's definition ships with this package."""
    return resources.files(__package__).joinpath("msg", f"{msgtype}.msg").is_file()


@cache
def definition(msgtype: str) -> str:
    """Definition of a message type followed by those it is made of, as MCAP's ros2msg wants it."""
    names = [msgtype]
    for name in names:  # grows while it runs: first the message, then each new part once
        package = name.split("/")[0]
        for match in _FIELD_TYPE.finditer(_own_text(name)):
            part = _full_name(match["type"], package)
            if part is not None and part not in names:
                names.append(part)
    parts = [_own_text(msgtype)]
    parts += [f"MSG: {name.replace('/msg/', '/')}\n{_own_text(name)}" for name in names[1:]]
    return _SEPARATOR.join(parts)


@cache
def encoder(msgtype: str) -> Callable[[Mapping[str, Any]], bytes]:
    """Function from a message as a mapping of its fields to CDR bytes."""
    encode: Callable[[Mapping[str, Any]], bytes] = serialize_dynamic(msgtype, definition(msgtype))[
        msgtype
    ]
    return encode


@cache
def decoder(msgtype: str, text: str | None = None) -> Callable[[bytes], Any]:
    """Function from CDR bytes to a message, by the definition ``text`` or else by our own."""
    with redirect_stderr(io.StringIO()):  # where the parser prints what it says in its error
        known = generate_dynamic(msgtype, text or definition(msgtype))
    decode: Callable[[bytes], Any] = known[msgtype]
    return decode


def header(stamp_ns: int, frame: str) -> dict[str, Any]:
    """Header with a stamp [ns] and the name of the frame the message is given in."""
    sec, nanosec = divmod(stamp_ns, 10**9)
    return {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": frame}


def stamp_ns(message: Any) -> int:
    """Stamp of a decoded message's header [ns]."""
    stamp = message.header.stamp
    ns = int(stamp.sec) * 10**9 + int(stamp.nanosec)
    if not -(2**63) <= ns < 2**63:  # where a file defines stamps in its own way
        raise ValueError(f"{ns} ns is no instant")
    return ns


def pose_fields(pose: gtsam.Pose3) -> dict[str, dict[str, float]]:
    """A pose as the fields of geometry_msgs/msg/Pose."""
    position = dict(zip("xyz", pose.translation().tolist(), strict=True))
    quaternion: Any = pose.rotation().toQuaternion()
    quat_xyzw = quaternion.coeffs().tolist()
    return {"position": position, "orientation": dict(zip("xyzw", quat_xyzw, strict=True))}


def pose_from_fields(pose: Any) -> gtsam.Pose3 | None:
    """Pose of a decoded geometry_msgs/msg/Pose; None where it is none.

    A pose is none if a number is not finite or if the quaternion's norm is not 1 to within 1 %, of
    which all zeros (a message never filled in) is the commonest case.
    """
    p, q = pose.position, pose.orientation
    norm = math.sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w)
    finite = all(map(math.isfinite, (p.x, p.y, p.z, norm)))
    if not finite or abs(norm - 1) > QUATERNION_TOLERANCE:
        return None
    rotation = gtsam.Rot3(q.w / norm, q.x / norm, q.y / norm, q.z / norm)
    return gtsam.Pose3(rotation, np.array([p.x, p.y, p.z]))
