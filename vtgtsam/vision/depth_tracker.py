# SPDX-License-Identifier: MIT
"""A model tracker that needs nothing but depth images."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import gtsam
import numpy as np

from .alignment import Evidence, Shape, align, outline_pixels, stride
from .camera import CameraIntrinsics
from .hand_mask import HandMask
from .search import Search
from .tracker import TrackedPose
from .view import View, crop

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..hand import HandModel
    from ..objects import ObjectModel

MARGIN = 0.02  # [m], around the object's bounding sphere: what it may move between two frames
COARSE_PIXELS, FINE_PIXELS = 400, 2000  # of the object's outline, for the first steps and the last

# A pose is kept while the images do not speak against it, and taken up again only where they speak for it.
MIN_VISIBLE, MIN_VISIBLE_FOUND = 0.03, 0.15  # share of the outline seen
MAX_CONTRADICTION, MAX_CONTRADICTION_FOUND = 0.15, 0.05  # share of pixels that see through it
MISFIT_FOUND = 2.0
MAX_SIGMA = 0.005  # [m], standard deviation of the object's centre
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
        self._search = Search(self._shape)
        self._T_wo: gtsam.Pose3 | None = None

    def start(self, T_wo: gtsam.Pose3) -> None:
        """Begin a sequence at the pose of its first frame."""
        self._T_wo = T_wo
        self._search.forget()

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
        view = crop(self.camera.check(depth), self.camera, *self._around(T_co))
        if view is None:
            return TrackedPose.lost()
        view = view.strided(stride(outline_pixels(self._shape, view, T_co), FINE_PIXELS))
        if self._hand is not None and joints is not None:
            T_hc = T_wc if T_wh is None else T_wh.inverse() * T_wc
            view.hand[:] = self._hand.mask(view.depth, view.camera, T_hc, joints)
        return self._track(view, T_co, T_wc)

    def _track(self, view: View, T_co: gtsam.Pose3, T_wc: gtsam.Pose3) -> TrackedPose:
        pose, seen = self._follow(view, T_co)
        good = self._is_good(seen, False)
        if not good and seen.measured < 0.1 * seen.outline:
            return TrackedPose.lost(seen.visible_fraction)
        if not good:
            pose, seen = self._follow(view, self._search.look(view, T_co, T_wc))
            good = self._is_good(seen, True)
        if not good:
            return TrackedPose.lost(seen.visible_fraction)
        self._search.forget()
        self._T_wo = T_wc * pose
        return TrackedPose(self._T_wo, self._covariance(seen), seen.visible_fraction, "ok")

    def _follow(self, view: View, T_co: gtsam.Pose3) -> tuple[gtsam.Pose3, Evidence]:
        outline = outline_pixels(self._shape, view, T_co)
        coarse = view.strided(stride(outline, COARSE_PIXELS))
        T_co = align(self._shape, coarse, T_co, iterations=4)
        T_co = align(self._shape, view, T_co, iterations=2)
        return T_co, Evidence(self._shape, view, T_co)

    def _covariance(self, seen: Evidence) -> np.ndarray:
        information, _ = seen.normal_equations()
        return np.linalg.inv(information / max(seen.misfit, 1.0) + 0.01 * self._shape.prior)

    def _is_good(self, seen: Evidence, found: bool) -> bool:
        """Whether an image supports a pose; one that was found needs better support."""
        if found and (
            seen.visible_fraction < MIN_VISIBLE_FOUND
            or seen.contradiction > MAX_CONTRADICTION_FOUND
            or seen.misfit > MISFIT_FOUND
        ):
            return False
        if seen.visible_fraction < MIN_VISIBLE or seen.contradiction > MAX_CONTRADICTION:
            return False
        A = self._shape.to_center()
        return bool(
            np.linalg.eigvalsh((A @ self._covariance(seen) @ A.T)[3:, 3:])[-1] < MAX_SIGMA**2
        )

    def _around(self, T_co: gtsam.Pose3) -> tuple[np.ndarray, float]:
        """Points that the view must show [m], shape (N, 3), camera frame, and the margin around them."""
        corners_c = T_co.transformFrom(self._shape.corners_o.T).T
        if not self._search.images:
            return corners_c, MARGIN
        center_c = corners_c.mean(axis=0)  # lost, it may have turned to any side
        radius = np.linalg.norm(corners_c - center_c, axis=1).max()
        return np.array([center_c]), radius + MARGIN + 2.0 * self._search.spread[1]
