# SPDX-License-Identifier: MIT
r"""The pads' signed distances where the joints' zeros are unknown, which two factors of a frame share.

The joints are at q - dq where they are measured at q, so pad k's point that is closest to the object lies at
p_k(q - dq) in the hand, and its distance is

    phi_k(T_ho, dq) = phi(T_ho^-1 p_k(q - dq)).

Both derivatives are exact, at the joints and the pose in question: that for a right perturbation of T_ho is
[ (grad phi x p_o)^T  -grad phi^T ], that for dq is -grad phi^T dp_k/dq, from the kinematics.
"""

from __future__ import annotations

import gtsam
import numpy as np

from ..hands.model import HandModel
from ..sdf.search import ClosestPoints, PadContacts


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
        self._measured = np.array(joints, dtype=np.float64)
        self._T_ho: gtsam.Pose3 | None = None
        self._zeros = np.empty(0)
        self._T_hp: np.ndarray
        self._contacts: PadContacts
        self._of_zeros: np.ndarray | None = None

    def at(self, T_ho: gtsam.Pose3, zeros: np.ndarray) -> PadContacts:
        """The pads' closest points; a pad that does not matter is left out.

        Args:
            T_ho: Pose of the object in the hand.
            zeros: The joints' zeros dq [rad], shape (J,).
        """
        known = self._T_ho is not None and T_ho.equals(self._T_ho, 0.0)
        if not (known and np.array_equal(zeros, self._zeros)):
            self._T_hp = self._hand.pad_transforms(self._measured - zeros)
            T = np.ascontiguousarray(T_ho.matrix())  # GTSAM's are in Fortran order
            self._contacts = self._closest.search(T, self._T_hp, self.touching)
            self._T_ho, self._zeros, self._of_zeros = T_ho, np.array(zeros), None
        return self._contacts

    def derivative_by_zeros(self, T_ho: gtsam.Pose3, zeros: np.ndarray) -> np.ndarray:
        """How the distances there change with the joints' zeros [m/rad], shape (K, J); zero for a pad left out."""
        contacts = self.at(T_ho, zeros)
        if self._of_zeros is None:
            points_h = np.nan_to_num(self._closest.points(self._T_hp, contacts.indices))
            gradients_h = -contacts.jacobians[:, 3:] @ T_ho.rotation().matrix().T
            joints = self._measured - zeros
            self._of_zeros = self._hand.zero_jacobian(joints, points_h, gradients_h)
        return self._of_zeros
