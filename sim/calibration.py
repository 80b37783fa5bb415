# SPDX-License-Identifier: MIT
"""What a real setup gets slightly wrong: where the camera is, where joints are zero, depth at edges.

Off by default, as in the paper. The errors are of the size a careful calibration leaves behind.
"""

from __future__ import annotations

from dataclasses import dataclass

import gtsam
import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

CAMERA_TRANSLATION = 0.002  # [m]
CAMERA_ROTATION = np.deg2rad(1.0)  # [rad]
JOINT_ZERO = np.deg2rad(1.0)  # [rad], standard deviation of each joint's zero
EDGE_STEP = 0.02  # [m], neighbouring depths that differ by more belong to two surfaces
_ROBOT = 7  # tells a robot's random numbers from those of a sequence
NOTHING = 1e3  # [m], stands for the depth of a pixel that measured nothing
HOLES = 0.5  # share of the pixels at an edge that measure nothing
FLYING = 0.25  # share of them that measure something between the two surfaces


@dataclass(frozen=True)
class CalibrationError:
    """The errors of a sequence, or of all sequences of one robot.

    Attributes:
        T_error: Where the camera is believed to be, T_wc believed = T_error T_wc. It turns about the
            world's origin, the wrist, as when the camera was calibrated by a tag there.
        joints: Measured minus true joint angles [rad], shape (J,).
        imperfect: Whether there is an error; depth then fails at edges too.
    """

    T_error: gtsam.Pose3
    joints: np.ndarray
    imperfect: bool

    @classmethod
    def none(cls, joint_count: int) -> CalibrationError:
        """A perfect setup."""
        return cls(gtsam.Pose3(), np.zeros(joint_count), imperfect=False)

    @classmethod
    def of_robot(cls, robot: int, joint_count: int) -> CalibrationError:
        """The errors of robot number ``robot``, the same in all its sequences."""
        return cls.drawn(joint_count, np.random.default_rng([_ROBOT, robot, joint_count]))

    @classmethod
    def drawn(cls, joint_count: int, rng: np.random.Generator) -> CalibrationError:
        """Camera off by 2 mm and 1 degree in a random direction, each joint's zero by about 1 degree."""
        rotation = gtsam.Rot3.Expmap(CAMERA_ROTATION * random_direction(rng))
        T_error = gtsam.Pose3(rotation, CAMERA_TRANSLATION * random_direction(rng))
        return cls(T_error, rng.normal(0.0, JOINT_ZERO, joint_count), imperfect=True)

    def spoil_depth(self, depth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """A depth image [m] with holes (0) and flying pixels at its edges, where depth fails there."""
        return with_bad_edges(depth, rng) if self.imperfect else depth


def with_bad_edges(depth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A depth image [m] as a stereo camera sees edges: holes (0) and pixels between the surfaces."""
    surface = np.where(depth > 0.0, depth, NOTHING)
    near_side, far_side = minimum_filter(surface, size=3), maximum_filter(surface, size=3)
    edge = (depth > 0.0) & (far_side - near_side > EDGE_STEP)
    chance, share = rng.random(depth.shape), rng.random(depth.shape)
    # In front of nothing there is no second surface to fly to, only holes.
    between = np.where(far_side < NOTHING, near_side + share * (far_side - near_side), 0.0)
    spoiled = np.where(edge & (chance < HOLES), 0.0, depth)
    return np.where(edge & (chance > 1.0 - FLYING), between, spoiled)


def random_direction(rng: np.random.Generator) -> np.ndarray:
    """A unit vector, shape (3,)."""
    vector = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)
