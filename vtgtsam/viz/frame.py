# SPDX-License-Identifier: MIT
"""One frame in the scene: hand and pads, the object's poses, and how far they are from each other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import gtsam
import numpy as np

from ..metrics import Adds
from . import names
from .scene import Scene

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..hands.model import HandModel
    from ..objects import ObjectModel


class FrameDrawing:
    """Draws what belongs to the instant at which the scene is.

    Args:
        scene: Where to.
        hand: The hand.
        obj: The object.
    """

    def __init__(self, scene: Scene, hand: HandModel, obj: ObjectModel) -> None:
        self._scene = scene
        self._pad_names = hand.pad_names
        self._center_o = obj.center
        self._adds = None if obj.mesh is None else Adds(obj.mesh)
        self._touched = np.zeros(len(hand), dtype=bool)

    def hand(
        self,
        joints: Mapping[str, float] | ArrayLike,
        T_wh: gtsam.Pose3,
        contacts: np.ndarray,
        distances: np.ndarray | None = None,
        weights: np.ndarray | None = None,
    ) -> None:
        """The hand, its pads, and a line in the plot for each pad while it touches.

        Args:
            joints: Joint angles [rad], as ``HandModel.joint_array`` takes them.
            T_wh: Pose of the hand in the world.
            contacts: Contact bits, shape (K,).
            distances: Pads' distances to the object where a method believes it [m], shape (K,).
            weights: How much each pad's contact counts, in [0, 1], shape (K,); None: in full.
        """
        self._scene.hand(joints, T_wh, contacts, weights)
        if distances is None:
            return
        for k in np.flatnonzero(contacts | self._touched):
            value = 1e3 * distances[k] if contacts[k] else np.nan  # NaN interrupts the line
            self._scene.plot(names.PAD_DISTANCE, self._pad_names[k], value)
        self._touched = np.array(contacts, dtype=bool)

    def pose(
        self,
        name: str,
        T_wo: gtsam.Pose3,
        T_wo_visual: gtsam.Pose3 | None = None,
        T_wo_true: gtsam.Pose3 | None = None,
    ) -> None:
        """The object where a method has it; plots its distance from the visual and the true pose."""
        self._scene.object(name, T_wo)
        if T_wo_true is not None and self._adds is not None:
            self._scene.plot(names.ADDS, name, 1e3 * self._adds(T_wo, T_wo_true))
        if T_wo_visual is not None and name not in names.VISION:
            apart = T_wo.transformFrom(self._center_o) - T_wo_visual.transformFrom(self._center_o)
            self._scene.plot(names.VISUAL_RESIDUAL, name, 1e3 * float(np.linalg.norm(apart)))

    def verdict(self, name: str, status: str, visual_weight: float) -> None:
        """What a method says of itself."""
        self._scene.status(name, status)
        self._scene.plot(names.WEIGHT, name, visual_weight)
