# SPDX-License-Identifier: MIT
"""A model tracker that needs nothing but depth images."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import gtsam
import numpy as np

from .alignment import Evidence, Shape, View, noise_of
from .camera import CameraIntrinsics
from .hand_mask import HandMask
from .tracker import TrackedPose

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..hand import HandModel
    from ..objects import ObjectModel

MARGIN = 0.02  # [m], around the object's bounding sphere: what it may move between two frames
BESIDE = 0.1  # weight of points beside the outline, which may as well be the hand's
BESIDE_HAND = 1.0
PRIOR_SIGMA = np.array(
    [0.05] * 3 + [0.01] * 3
)  # [rad, m] per frame: holds what the image does not show
FORMS = ("depth", "depth-hand")


def make_tracker(
    form: str, obj: ObjectModel, camera: CameraIntrinsics, hand: HandModel
) -> DepthTracker:
    """The tracker of that name: "depth" knows nothing of the hand, "depth-hand" its geometry."""
    if form not in FORMS:
        raise ValueError(f"expected one of the trackers {', '.join(FORMS)}, got {form!r}")
    return DepthTracker(obj, camera, hand if form == "depth-hand" else None)


class DepthTracker:
    """Follows an object by aligning its distance field with depth images, from the previous pose.

    Args:
        obj: The object; only its distance field is used.
        camera: Intrinsics of the depth images.
        hand: None for a tracker that knows nothing of the hand (form "depth"); else the hand's pixels are
            removed by its geometry at the joint angles given with each image (form "depth-hand").
    """

    def __init__(
        self, obj: ObjectModel, camera: CameraIntrinsics, hand: HandModel | None = None
    ) -> None:
        self.camera = camera
        self._shape = Shape(obj.sdf)
        self._hand = None if hand is None else HandMask(hand)
        self._beside = BESIDE if hand is None else BESIDE_HAND
        self._T_wo: gtsam.Pose3 | None = None

    def start(self, T_wo: gtsam.Pose3) -> None:
        """Begin a sequence at the pose of its first frame."""
        self._T_wo = T_wo

    def update(
        self,
        depth: np.ndarray,
        T_wc: gtsam.Pose3,
        joints: ArrayLike | Mapping[str, float] | None = None,
        T_wh: gtsam.Pose3 | None = None,
    ) -> TrackedPose:
        """The pose in the next image (see ``VisualTracker.update``).

        Raises:
            ValueError: The image has the wrong size, or no ``start`` came before, or a tracker that knows the
                hand was not given its joints.
        """
        if self._T_wo is None:
            raise ValueError("the tracker has no pose to go on from; call start(T_wo) first")
        if self._hand is not None and joints is None:
            raise ValueError("a tracker that knows the hand needs its joint angles each frame")
        T_co = T_wc.inverse() * self._T_wo
        view = self._view(self.camera.check(depth), T_co)
        if view is None:
            return TrackedPose.lost()
        if self._hand is not None and joints is not None:
            T_hc = T_wc if T_wh is None else T_wh.inverse() * T_wc
            view.hand[:] = self._hand.mask(view.depth, view.camera, T_hc, joints)
        T_co, seen = self._align(view, T_co)
        self._T_wo = T_wc * T_co
        covariance = np.linalg.inv(seen.information + 1e-2 * np.diag(1.0 / PRIOR_SIGMA**2))
        return TrackedPose(self._T_wo, covariance, seen.visible_fraction, "ok")

    def _align(self, view: View, start: gtsam.Pose3) -> tuple[gtsam.Pose3, Evidence]:
        prior = np.diag(1.0 / PRIOR_SIGMA**2)
        T_co = start
        coarse = view.strided(2)
        for current, most in ((coarse, 4), (view, 2)):
            for _ in range(most):
                seen = Evidence(self._shape, current, T_co, self._beside)
                step = start.localCoordinates(T_co)
                delta = np.linalg.solve(seen.information + prior, -(seen.gradient + prior @ step))
                T_co = T_co.retract(delta)
                if abs(delta[:3]).max() < 5e-4 and abs(delta[3:]).max() < 2e-5:
                    break
        return T_co, seen

    def _view(self, depth: np.ndarray, T_co: gtsam.Pose3) -> View | None:
        """The image around the object's bounding sphere; None where that lies outside the image."""
        center = T_co.transformFrom(self._shape.center_o)
        reach = self._shape.radius + MARGIN
        if center[2] <= reach:
            return None
        u, v = self.camera.project(center[None])[0]
        half = reach / (center[2] - reach)
        left = int(np.clip(u - half * self.camera.fx, 0, self.camera.width))
        right = int(np.clip(u + half * self.camera.fx + 1, 0, self.camera.width))
        top = int(np.clip(v - half * self.camera.fy, 0, self.camera.height))
        bottom = int(np.clip(v + half * self.camera.fy + 1, 0, self.camera.height))
        if left >= right or top >= bottom:
            return None
        image = np.ascontiguousarray(depth[top:bottom, left:right])
        near = np.where(abs(image - center[2]) < reach, image, 0.0)
        return View(
            image,
            np.zeros(image.shape, dtype=bool),
            self.camera.cropped(left, top, right - left, bottom - top),
            max(noise_of(near), 0.5e-3),
        )
