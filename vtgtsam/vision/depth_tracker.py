# SPDX-License-Identifier: MIT
"""A model tracker that needs nothing but depth images."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import gtsam
import numpy as np

from .alignment import PRIOR, Evidence, Shape, View, align, noise_of
from .camera import CameraIntrinsics
from .hand_mask import HandMask
from .tracker import TrackedPose

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..hand import HandModel
    from ..objects import ObjectModel

MARGIN = 0.02  # [m], around the object's bounding sphere: what it may move between two frames
BESIDE = 0.1  # weight of points beside the outline, which may as well be the hand's ...
BESIDE_HAND = 1.0  # ... and where the hand's pixels are known
CANDIDATES, KEPT = 40, 4
VMIN = 0.08
CMAX = 0.15
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
        self._frames_lost = 0
        self._hypotheses: list[gtsam.Pose3] = []
        self._rng = np.random.default_rng(0)

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
        T_co, seen = self._follow(view, T_co)
        if not is_good(seen):
            T_co, seen = self._search(view, T_co)
            if not is_good(seen):
                self._frames_lost += 1
                return TrackedPose.lost(seen.visible_fraction)
        self._frames_lost = 0
        self._T_wo = T_wc * T_co
        information, _ = seen.normal_equations(self._beside)
        return TrackedPose(
            self._T_wo, np.linalg.inv(information + 1e-2 * PRIOR), seen.visible_fraction, "ok"
        )

    def _follow(self, view: View, T_co: gtsam.Pose3) -> tuple[gtsam.Pose3, Evidence]:
        T_co = align(self._shape, view.strided(2), T_co, self._beside, iterations=4)
        T_co = align(self._shape, view, T_co, self._beside, iterations=2)
        return T_co, Evidence(self._shape, view, T_co)

    def _search(self, view: View, T_co: gtsam.Pose3) -> tuple[gtsam.Pose3, Evidence]:
        """The best of many poses around the last good one, spread the wider the longer it is lost."""
        spread = 1.0 + self._frames_lost / 5
        sigma = np.array([min(0.1 * spread, 1.5)] * 3 + [min(0.006 * spread, 0.04)] * 3)
        center = gtsam.Pose3(gtsam.Rot3(), self._shape.center_o)
        tries = [
            T_co * center * gtsam.Pose3.Expmap(xi) * center.inverse()
            for xi in self._rng.normal(size=(CANDIDATES, 6)) * sigma
        ]
        tries += self._hypotheses
        coarse = view.strided(3)
        scores = [Evidence(self._shape, coarse, T).score for T in tries]
        best = np.argsort(scores)[::-1][:KEPT]
        half = view.strided(2)
        self._hypotheses = [
            align(self._shape, half, tries[i], self._beside, iterations=4) for i in best
        ]
        scores = [Evidence(self._shape, half, T).score for T in self._hypotheses]
        return self._follow(view, self._hypotheses[int(np.argmax(scores))])

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


def is_good(seen: Evidence) -> bool:
    """Whether an image supports a pose."""
    return seen.visible_fraction > VMIN and seen.contradiction < CMAX
