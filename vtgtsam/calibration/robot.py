# SPDX-License-Identifier: MIT
"""Whose calibration it is: a hand with its joints, and a camera in its place."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import gtsam
import numpy as np

from ..exceptions import CalibrationError
from ..frame import require_finite_pose

if TYPE_CHECKING:
    from ..hands.pads import PadSet
    from ..recording import Recording

# Two measurements of one camera's pose differ by less.
SAME_PLACE = 0.02  # [m]
SAME_DIRECTION = math.radians(5.0)


@dataclass(frozen=True, eq=False)
class Robot:
    """A hand and a camera.

    Attributes:
        hand: The hand's name.
        joint_names: Its joints.
        camera_name: The camera's name, a serial number perhaps; empty where it is not known.
        T_wc: Where the camera is believed to be; None where that is not known.
    """

    hand: str
    joint_names: tuple[str, ...]
    camera_name: str = ""
    T_wc: gtsam.Pose3 | None = None

    @classmethod
    def of(cls, recording: Recording) -> Robot:
        """The robot that a recording was made with.

        Raises:
            CalibrationError: Its camera moves, so that its error has no one place.
        """
        hand, T_wc = recording.hand, recording.camera_pose
        robot = cls(hand.name, hand.joint_names, recording.info.get("camera", ""), T_wc)
        stream = recording.streams.camera_pose
        if stream is not None and T_wc is not None:
            far = [T for T in stream.poses if not _same_place(T, T_wc)]
            if far:
                raise CalibrationError(
                    f"its camera moves by {_difference(far[0], T_wc)}; calibrate with a camera that stands still"
                )
        return robot

    @classmethod
    def of_hand(cls, hand: PadSet) -> Robot:
        """A hand whose camera is not known.

        Raises:
            CalibrationError: It has no joints.
        """
        joint_names = getattr(hand, "joint_names", None)
        if joint_names is None:
            raise CalibrationError(f"a calibration corrects joints; {hand!r} has none")
        return cls(getattr(hand, "name", ""), joint_names)

    def check_hand(self, hand: PadSet, whose: str = "this calibration") -> None:
        """Refuse another hand.

        Raises:
            CalibrationError: The hand's or its joints' names differ, or it has none.
        """
        joint_names = getattr(hand, "joint_names", None)
        if joint_names is None:
            raise CalibrationError(
                f"{whose} is of hand {self.hand!r}, whose joints it corrects; {hand!r} has none"
            )
        name = getattr(hand, "name", "")
        if name != self.hand:
            raise CalibrationError(f"{whose} is of hand {self.hand!r}, not of {name!r}")
        if joint_names != self.joint_names:
            odd = sorted(set(self.joint_names) ^ set(joint_names)) or list(joint_names)
            raise CalibrationError(
                f"{whose} is of a hand {self.hand!r} with other joints: {', '.join(odd)}"
            )

    def check(self, recording: Recording, whose: str = "this calibration") -> None:
        """Refuse a recording of another hand or camera.

        Raises:
            CalibrationError: It is, or its camera moves.
        """
        self.check_hand(recording.hand, whose)
        self.check_camera(Robot.of(recording), whose)

    def check_camera(self, other: Robot, whose: str = "this calibration") -> None:
        """Refuse another camera, or one that was moved.

        Raises:
            CalibrationError: The other robot has another one.
        """
        if self.camera_name and other.camera_name and self.camera_name != other.camera_name:
            raise CalibrationError(
                f"{whose} is of camera {self.camera_name!r}, not of {other.camera_name!r}"
            )
        if self.T_wc is not None and other.T_wc is not None:
            if not _same_place(self.T_wc, other.T_wc):
                raise CalibrationError(
                    f"{whose} is of a camera {_difference(self.T_wc, other.T_wc)} away from this one, "
                    "or it was moved since: its error is another one now"
                )

    def to_dict(self) -> dict[str, Any]:
        """As the calibration's file has it."""
        known: dict[str, Any] = {"hand": self.hand, "camera_name": self.camera_name}
        if self.T_wc is not None:
            known["camera_pose"] = self.T_wc.matrix()[:3].tolist()
        return known

    @classmethod
    def from_dict(cls, content: dict[str, Any]) -> Robot:
        """What ``to_dict`` wrote, in a calibration's file."""
        rows = content.get("camera_pose")
        T_wc = None
        if rows is not None:
            T_wc = gtsam.Pose3(np.vstack([np.array(rows, dtype=np.float64), [0, 0, 0, 1]]))
            require_finite_pose(T_wc, "camera_pose")
        joints = tuple(str(name) for name in content["joint_zeros_rad"])
        return cls(str(content["hand"]), joints, str(content.get("camera_name", "")), T_wc)


def _same_place(T: gtsam.Pose3, other: gtsam.Pose3) -> bool:
    angle, distance = _apart(T, other)
    return angle <= SAME_DIRECTION and distance <= SAME_PLACE


def _apart(T: gtsam.Pose3, other: gtsam.Pose3) -> tuple[float, float]:
    between = T.between(other)
    angle = float(np.linalg.norm(gtsam.Rot3.Logmap(between.rotation())))
    return angle, float(np.linalg.norm(between.translation()))


def _difference(T: gtsam.Pose3, other: gtsam.Pose3) -> str:
    angle, distance = _apart(T, other)
    return f"{1e3 * distance:.0f} mm and {math.degrees(angle):.0f} degrees"
