# SPDX-License-Identifier: MIT
"""A model tracker that needs nothing but depth images."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import gtsam
import numpy as np

from ..camera import CameraIntrinsics
from .alignment import Evidence, Shape, align, outline_pixels, stride
from .hand_mask import HandMask
from .search import Search, score
from .tracker import TrackedPose
from .view import View, crop

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..hands.model import HandModel
    from ..objects import ObjectModel

MARGIN = 0.02  # [m], around the object: what it may move between two frames
COARSE_PIXELS, FINE_PIXELS = 400, 2000  # of the object's outline, for the first steps and the last
WEAK = 0.01  # share of the frame-to-frame prior that is left in the covariance: 0.5 rad, 0.1 m
MIN_MEASURED = 0.1  # share of the outline; with less, the image cannot say where the object is not
MAX_SIGMA = 0.005  # [m], of the centre, by the noise alone; above, nothing is known of it

# What the pixels' noise leaves out: pixels wrongly taken for the object's, and the object's own grid and mesh.
# Four times as much is careful in nine of ten grasps in the clear and right in about half of those that fingers
# cover, where the rest are wrong beyond any noise (`python -m benchmarks consistency`).
INFLATION = 4.0
FLOOR = np.repeat([0.003**2, 0.0003**2], 3)  # [rad^2, m^2]


class Demand(NamedTuple):
    """What an image must say of a pose that is to be believed (attributes of ``Evidence``)."""

    visible_fraction: float  # at least
    contradiction: float  # at most
    misfit: float  # at most


# A right pose under noise 1 to 3 times a D435's has contradictions up to 0.03, 0.08 and misfits up to 1.3, 1.9
# (99th percentile of each sequence). A pose that was followed is given up late, one that was searched for is
# taken up only where it is clearly seen: a hand has places that look like many an object.
FOLLOWED = Demand(visible_fraction=0.03, contradiction=0.15, misfit=4.0)
FOUND = Demand(visible_fraction=0.15, contradiction=0.05, misfit=2.0)
BETTER = 0.05  # by so much higher must the score be where the tracker was told to look

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
        self._hint: gtsam.Pose3 | None = None

    def start(self, T_wo: gtsam.Pose3) -> None:
        """Begin a sequence at the pose of its first frame."""
        self._T_wo = T_wo
        self._hint = None
        self._search.forget()

    def search_at(self, T_wo: gtsam.Pose3) -> None:
        """Look for the object near this pose, too, in the next image (see ``hand_back``).

        It is taken up only where the image shows the object there, and better than where it was followed to. What
        the image does not show stays as it was at that pose, and the covariance says that it is not known.
        """
        self._hint = T_wo

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
        hint, self._hint = self._hint, None
        T_co_hint = None if hint is None else T_wc.inverse() * hint
        view = crop(self.camera.check(depth), self.camera, *self._around(T_co, T_co_hint))
        if view is None:
            return TrackedPose.lost()
        view = view.strided(stride(outline_pixels(self._shape, view, T_co), FINE_PIXELS))
        if self._hand is not None and joints is not None:
            T_hc = T_wc if T_wh is None else T_wh.inverse() * T_wc
            view.hand[:] = self._hand.mask(view.depth, view.camera, T_hc, joints)
        return self._track(view, T_co, T_wc, T_co_hint)

    def _track(
        self, view: View, T_co: gtsam.Pose3, T_wc: gtsam.Pose3, T_co_hint: gtsam.Pose3 | None
    ) -> TrackedPose:
        T_co_now, seen = self._follow(view, T_co)
        good = self._meets(seen, FOLLOWED)
        if T_co_hint is not None:
            T_there, there = self._follow(view, T_co_hint)
            if self._meets(there, FOUND) and not (good and score(there) < score(seen) + BETTER):
                T_co_now, seen, good = T_there, there, True
        if not good and seen.measured > MIN_MEASURED * seen.outline:
            T_co_now, seen = self._follow(view, self._search.look(view, T_co, T_wc))
            good = self._meets(seen, FOUND)
        if not good:
            return TrackedPose.lost(seen.visible_fraction)
        self._search.forget()
        self._T_wo = T_wc * T_co_now
        covariance = INFLATION * self._noise(seen) + np.diag(FLOOR)
        return TrackedPose(self._T_wo, covariance, seen.visible_fraction, "ok")

    def _follow(self, view: View, T_co: gtsam.Pose3) -> tuple[gtsam.Pose3, Evidence]:
        """The pose near ``T_co``, and what the image says of it."""
        outline = outline_pixels(self._shape, view, T_co)
        coarse = view.strided(stride(outline, COARSE_PIXELS))
        T_co = align(self._shape, coarse, T_co, iterations=4)
        T_co = align(self._shape, view, T_co, iterations=2)
        return T_co, Evidence(self._shape, view, T_co)

    def _meets(self, seen: Evidence, demand: Demand) -> bool:
        return (
            seen.visible_fraction >= demand.visible_fraction
            and seen.contradiction <= demand.contradiction
            and seen.misfit <= demand.misfit
            and self._center_sigma(seen) <= MAX_SIGMA
        )

    def _noise(self, seen: Evidence) -> np.ndarray:
        """Covariance of the pose by the pixels' noise, (6, 6); what they do not show is uncertain, not infinite."""
        information, _ = seen.normal_equations()
        return np.linalg.inv(information / max(seen.misfit, 1.0) + WEAK * self._shape.prior)

    def _center_sigma(self, seen: Evidence) -> float:
        """Largest standard deviation of the object's centre in any direction [m]."""
        A = self._shape.to_center()
        at_center = A @ self._noise(seen) @ A.T
        return float(np.sqrt(np.linalg.eigvalsh(at_center[3:, 3:])[-1]))

    def _around(self, T_co: gtsam.Pose3, T_co_hint: gtsam.Pose3 | None) -> tuple[np.ndarray, float]:
        """Points that the view must show [m], shape (N, 3), camera frame, and the margin around them [m]."""
        poses = [T_co] if T_co_hint is None else [T_co, T_co_hint]
        corners_c = np.concatenate([T.transformFrom(self._shape.corners_o.T).T for T in poses])
        if not self._search.images:
            return corners_c, MARGIN
        center_c = corners_c.mean(axis=0)  # lost, it may have turned to any side
        radius = np.linalg.norm(corners_c - center_c, axis=1).max()
        return np.array([center_c]), radius + MARGIN + 2.0 * self._search.spread[1]
