# SPDX-License-Identifier: MIT
r"""The pads' signed distances where the joints' zeros are unknown, which two factors of a frame share.

The joints are at q - dq where they are measured at q, so pad k's point that is closest to the object lies at
p_k(q - dq) in the hand, and its distance is

    phi_k(T_ho, dq) = phi(T_ho^-1 p_k(q - dq)).

Both derivatives are exact, at the joints and the pose in question: that for a right perturbation of T_ho is
[ (grad phi x p_o)^T  -grad phi^T ], that for dq is -grad phi^T dp_k/dq, from the kinematics.
"""

from __future__ import annotations

from typing import NamedTuple

import gtsam
import numpy as np

from ..hands.model import HandModel
from ..sdf.search import ClosestPoints


class JointedContacts(NamedTuple):
    """Each pad's closest point, at one pose and one set of zeros.

    Attributes:
        distances: Signed distances phi_k [m], shape (K,); infinite for a pad that was left out.
        of_pose: Their derivatives for a right perturbation of T_ho, rotation first, shape (K, 6).
        of_zeros: Their derivatives for the joints' zeros dq [m/rad], shape (K, J).
    """

    distances: np.ndarray
    of_pose: np.ndarray
    of_zeros: np.ndarray


class JointedPads:
    """One frame's pads, on joints whose zeros are unknown.

    GTSAM evaluates several factors at each point, and the error before the Jacobian: the last answer is kept.

    Args:
        hand: The hand.
        closest: Finds its pads' closest points to the object.
        joints: Joint angles as measured [rad], shape (J,).
        touching: Which pads report contact, bool, shape (K,). The others matter where they reach into the object.

    Attributes:
        touching: As given.
        joints: J, the number of joints.
    """

    def __init__(
        self, hand: HandModel, closest: ClosestPoints, joints: np.ndarray, touching: np.ndarray
    ) -> None:
        self.touching = np.array(touching, dtype=bool)
        self.joints = len(hand.joint_names)
        self._hand = hand
        self._closest = closest
        self._joints = np.array(joints, dtype=np.float64)
        self._T_ho: gtsam.Pose3 | None = None
        self._zeros = np.empty(0)
        self._contacts: JointedContacts

    def at(self, T_ho: gtsam.Pose3, zeros: np.ndarray) -> JointedContacts:
        """The pads' distances with the object at T_ho in the hand and the joints' zeros at ``zeros`` [rad], (J,)."""
        known = self._T_ho is not None and T_ho.equals(self._T_ho, 0.0)
        if not (known and np.array_equal(zeros, self._zeros)):
            self._contacts = self._at(T_ho, zeros)
            self._T_ho, self._zeros = T_ho, np.array(zeros)
        return self._contacts

    def _at(self, T_ho: gtsam.Pose3, zeros: np.ndarray) -> JointedContacts:
        joints = self._joints - zeros
        T_hp = self._hand.pad_transforms(joints)
        T = np.ascontiguousarray(T_ho.matrix())  # GTSAM's are in Fortran order
        found = self._closest.search(T, T_hp, self.touching)
        points_h = np.nan_to_num(self._closest.points(T_hp, found.indices))
        gradients_h = -found.jacobians[:, 3:] @ T[:3, :3].T
        of_zeros = self._hand.zero_jacobian(joints, points_h, gradients_h)
        return JointedContacts(found.distances, found.jacobians, of_zeros)
