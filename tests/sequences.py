# SPDX-License-Identifier: MIT
"""A hand of two pads and a short sequence with it, for the tests of recordings."""

from pathlib import Path

import gtsam
import numpy as np

from vtgtsam.hands.model import HandModel
from vtgtsam.recording import RecordingWriter

HAND_XML = """<mujoco model="gripper">
  <worldbody>
    <body name="left"><joint name="j_left" axis="0 0 1"/><geom size="0.01"/>
      <site name="pad_left" type="box" size="0.01 0.01 0.001"/></body>
    <body name="right"><joint name="j_right" axis="0 0 1"/><geom size="0.01"/>
      <site name="pad_right" type="box" size="0.01 0.01 0.001"/></body>
  </worldbody>
</mujoco>
"""

JOINTS = ("j_left", "j_right")
PADS = ("pad_left", "pad_right")


SIDE = gtsam.Pose3(gtsam.Rot3(), np.array([0.035, 0.0, 0.0]))  # of a can or ball


def gripper() -> HandModel:
    return HandModel.from_text(HAND_XML)


def pose(x: float, angle: float = 0.3) -> gtsam.Pose3:
    return gtsam.Pose3(gtsam.Rot3.RzRyRx(angle, -0.2, 0.1), np.array([x, 0.02, 0.1]))


def write_sequence(
    path: Path, seconds: float = 3.0, metadata=None, start: float = 1.0, **attachments
) -> Path:
    """Joints, contacts, hand and truth at 100 Hz, vision at 1/0.033 Hz, from ``start`` [s] on.

    At the instant t, joint angles are (t, -t), the object's x is t, and pad_left touches from 2 s on: the
    hand goes along on the object's side.
    """
    with RecordingWriter(path, metadata, **attachments) as writer:
        writer.camera_pose(1.0, pose(0.5))
        for k in range(round(seconds * 100)):
            t = start + 0.01 * k
            writer.joint_states(t, JOINTS, [t, -t])
            writer.tactile(t, PADS, [0.5 * (t >= 2.0), 0.0], [t >= 2.0, False])
            writer.hand_pose(t, pose(t) * SIDE)
            writer.truth(t, pose(t))
        for k in range(int(seconds / 0.033)):
            writer.object_pose(start + 0.033 * k, pose(start + 0.033 * k))
    return path
