# SPDX-License-Identifier: MIT
"""Recordings as another robot would have made them: the same grasps, with its camera and its joint zeros.

A tracker that knows nothing of the hand sees the object in the camera's frame alike wherever the camera is believed to
be. So a camera's error is one motion of all visual poses, and a joint's zero one number on its angles: any number of
robots cost no more simulation.
"""

from __future__ import annotations

import dataclasses
from zlib import crc32

import gtsam
import numpy as np

from sim.calibration import CalibrationError
from vtgtsam.exceptions import RecordingError
from vtgtsam.recording import Recording
from vtgtsam.recording.align import Streams
from vtgtsam.recording.named import NamedStream
from vtgtsam.recording.poses import PoseStream

TRACKER = "depth"  # knows nothing of the hand


def as_robot(recording: Recording, robot: int | None) -> Recording:
    """A simulated recording as robot number ``robot`` would have made it; None: one without error.

    Raises:
        RecordingError: Its tracker knows of the hand, or its own error is not known.
    """
    info = recording.info
    if info.get("tracker") != TRACKER:
        raise RecordingError(
            f"{recording.path}: expected tracker {TRACKER!r}, got {info.get('tracker')!r}"
        )
    if info.get("calibration_error") == "yes" and "robot" not in info:
        raise RecordingError(
            f"{recording.path} has an error of its own, not that of a robot (--robot)"
        )
    hand, streams = recording.hand, recording.streams
    own = robot_error(int(info["robot"]) if info.get("robot") else None, len(hand.joint_names))
    wanted = robot_error(robot, len(hand.joint_names))
    moved = wanted.T_error.compose(own.T_error.inverse())
    zeros = dict(zip(hand.joint_names, wanted.joints - own.joints, strict=True))
    assert streams.joints is not None and streams.vision is not None
    made = dataclasses.replace(
        streams,
        joints=_shifted(streams.joints, zeros),
        vision=_moved(streams.vision, moved),
        camera_pose=None if streams.camera_pose is None else _moved(streams.camera_pose, moved),
    )
    return _made(recording, _described(info, robot), made)


def misled(recording: Recording, by: float) -> Recording:
    """A recording whose tracker is off by as much [m] in a direction of each object's own, which its name decides."""
    direction = np.random.default_rng(crc32(recording.object.name.encode())).normal(size=3)
    off = gtsam.Pose3(gtsam.Rot3(), by * direction / np.linalg.norm(direction))
    streams = recording.streams
    assert streams.vision is not None
    poses = [pose.compose(off) for pose in streams.vision.poses]
    vision = dataclasses.replace(streams.vision, poses=poses)
    return _made(recording, recording.info, dataclasses.replace(streams, vision=vision))


def _made(recording: Recording, info: dict[str, str], streams: Streams) -> Recording:
    """The recording with other streams."""
    hand = recording.hand
    return Recording(
        path=recording.path,
        info=info,
        topics=recording.topics,
        streams=streams,
        make_hand=lambda: hand,
        make_object=lambda: recording.object,
        present={},
    )


def _described(info: dict[str, str], robot: int | None) -> dict[str, str]:
    return info | {
        "robot": "" if robot is None else str(robot),
        "calibration_error": "no" if robot is None else "yes",
    }


def robot_error(robot: int | None, joints: int) -> CalibrationError:
    """What a robot believes wrongly; None: nothing."""
    if robot is None:
        return CalibrationError.none(joints)
    return CalibrationError.of_robot(robot, joints)


def true_offsets(robot: int | None, joints: int, camera_origin: np.ndarray) -> np.ndarray:
    """The same as a ``Calibration`` has it: the camera's twist about a point, then joint zeros, shape (6 + J,)."""
    error = robot_error(robot, joints)
    about = gtsam.Pose3(gtsam.Rot3(), camera_origin)
    moved = about.inverse().compose(error.T_error).compose(about)
    return np.concatenate([gtsam.Pose3.Logmap(moved), error.joints])


def _shifted(stream: NamedStream, by: dict[str, float]) -> NamedStream:
    columns = {
        name: (times, values + by.get(name, 0.0))
        for name, (times, values) in stream.columns.items()
    }
    return dataclasses.replace(stream, columns=columns)


def _moved(stream: PoseStream, by: gtsam.Pose3) -> PoseStream:
    return dataclasses.replace(stream, poses=[by.compose(pose) for pose in stream.poses])
