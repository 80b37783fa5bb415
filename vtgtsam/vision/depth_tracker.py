# SPDX-License-Identifier: MIT
"""A model tracker that needs nothing but depth images, and makes use of infrared ones beside them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import gtsam
import numpy as np

from ..camera import CameraIntrinsics
from .alignment import Evidence, Shape, align, outline_pixels, stride
from .contour import learn_shading
from .expectation import WEAK, Expectation
from .hand_mask import HandMask
from .infrared import infrared_part
from .noise import APART, DepthNoise
from .search import Search, score
from .shading import Shading
from .tracker import TrackedPose
from .view import View, crop

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..hands.model import HandModel
    from ..objects import ObjectModel

MARGIN = 0.02  # [m], around the object: what it may move between two frames
COARSE_PIXELS, FINE_PIXELS = 400, 2000  # of the object's outline, for the first steps and the last
MIN_MEASURED = 0.1  # share of the outline; with less, the image cannot say where the object is not

LASTING = 20.0  # [s], noise that stays for some images stays as long as a grasp is looked at
IMAGE = 1 / 30  # [s], from one image to the next

# What noise leaves out: the object's own grid and mesh.
FLOOR = np.repeat([0.001**2, 0.0001**2], 3)  # [rad^2, m^2]


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

PATIENCE = (
    30  # images that may deny the pose of what a hand carries before another pose is looked for
)

FORMS = ("depth", "depth-hand")


def make_tracker(
    form: str, obj: ObjectModel, camera: CameraIntrinsics, hand: HandModel | None
) -> DepthTracker:
    """The tracker of that name: "depth" knows nothing of the hand, "depth-hand" its geometry."""
    if form not in FORMS:
        raise ValueError(f"expected one of the trackers {', '.join(FORMS)}, got {form!r}")
    if form == "depth-hand" and hand is None:
        raise ValueError("the tracker depth-hand needs the hand's model")
    return DepthTracker(obj, camera, hand if form == "depth-hand" else None)


class DepthTracker:
    """Follows an object by aligning its distance field with depth images, from the previous pose.

    Images are taken to come 30 times a second: by that it says for how many seconds its errors stay alike.

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
        self._noise, self._shading = DepthNoise(), Shading()
        self._expected: Expectation | None = None
        self._hint: gtsam.Pose3 | None = None
        self._unseen = 0  # images that did not support the pose, since the last one that did

    def start(self, T_wo: gtsam.Pose3) -> None:
        """Begin a sequence at the pose of its first frame."""
        self._expected = Expectation(self._shape, T_wo)
        self._hint = None
        self._search.forget()
        self._noise, self._shading = DepthNoise(), Shading()
        self._unseen = 0

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
        infrared: np.ndarray | None = None,
    ) -> TrackedPose:
        """The pose in the next image (see ``VisualTracker.update``).

        Args:
            depth: See there.
            T_wc: See there.
            joints: See there.
            T_wh: See there.
            infrared: The left infrared image of the stereo camera that measured the depth, of uint8 and the same
                shape. A tracker that knows the hand finds the object's outline in it; another one cannot tell an
                outline from a finger's, and does not look at it.

        Raises:
            ValueError: An image has the wrong size or type, or no ``start`` came before, or a tracker that knows
                the hand was not given its joints.
        """
        if self._expected is None:
            raise ValueError("the tracker has no pose to go on from; call start(T_wo) first")
        if self._hand is not None and joints is None:
            raise ValueError("a tracker that knows the hand needs its joint angles each frame")
        self._expect(self._expected, joints, T_wh)
        T_co = T_wc.inverse() * self._expected.T_wo
        hint, self._hint = self._hint, None
        T_co_hint = None if hint is None else T_wc.inverse() * hint
        view = crop(self.camera.check(depth), self.camera, *self._around(T_co, T_co_hint))
        if view is None:
            return TrackedPose.lost()
        if infrared is not None and self._hand is not None:
            part = infrared_part(infrared, self.camera, view.camera, self._shading)
            view = replace(view, infrared=part)
        view = view.strided(stride(outline_pixels(self._shape, view, T_co), FINE_PIXELS))
        if self._hand is not None and joints is not None:
            T_hc = T_wc if T_wh is None else T_wh.inverse() * T_wc
            view.hand_depth[:] = self._hand.depth(view.camera, T_hc, joints)
            view.hand[:] = self._hand.covers(view.depth, view.hand_depth)
        return self._track(view, self._expected, T_wc, T_co_hint)

    def _expect(
        self,
        expected: Expectation,
        joints: ArrayLike | Mapping[str, float] | None,
        T_wh: gtsam.Pose3 | None,
    ) -> None:
        if self._hand is None or joints is None or T_wh is None:
            expected.wait()
        else:
            expected.carry(T_wh, self._hand.hand.joint_array(joints), self._noise.persistence)

    def _track(
        self,
        measured: View,
        expected: Expectation,
        T_wc: gtsam.Pose3,
        T_co_hint: gtsam.Pose3 | None,
    ) -> TrackedPose:
        T_co = T_wc.inverse() * expected.T_wo
        view = self._with_noise(measured, T_co)
        T_co_now, seen = self._follow(view, T_co, expected.information())
        good, anew = self._meets(seen, FOLLOWED), False
        if T_co_hint is not None:
            T_there, there = self._follow(self._with_noise(measured, T_co_hint), T_co_hint)
            if self._meets(there, FOUND) and not (good and score(there) < score(seen) + BETTER):
                T_co_now, seen, good, anew = T_there, there, True, True
        if not good and expected.is_carried:  # it may have moved otherwise than the hand
            T_co_now, seen = self._follow(view, T_co)
            good = anew = self._meets(seen, FOUND)
        self._unseen = 0 if good else self._unseen + 1
        if not good and expected.is_carried and self._unseen < PATIENCE:
            if score(seen) > score(Evidence(self._shape, view, T_co)):
                expected.T_wo = T_wc * T_co_now  # not good yet, but on the way there
            return self._tracked(expected, np.zeros((6, 6)), seen)
        if not good and seen.measured > MIN_MEASURED * seen.outline:
            T_co_now, seen = self._follow(view, self._search.look(view, T_co, T_wc))
            good = anew = self._meets(seen, FOUND)
        if not good:
            return TrackedPose.lost(seen.visible_fraction)
        self._unseen = 0
        self._search.forget()
        self._learn(measured, seen)
        information, credible = seen.normal_equations()[0], seen.credible()
        expected.update(T_wc * T_co_now, information, credible, anew)
        return self._tracked(expected, credible, seen)

    def _with_noise(self, measured: View, T_co: gtsam.Pose3) -> View:
        """The view with what was learnt of the camera's noise; in the first one, from that image itself."""
        at = Evidence(self._shape, measured, T_co)
        if self._noise.images == 0:
            self._learn(measured, at)
        return self._noise.on(measured, at)

    def _learn(self, measured: View, seen: Evidence) -> None:
        self._noise.learn(measured, seen)
        if measured.infrared is not None:
            learn_shading(measured, seen)

    def _tracked(
        self, expected: Expectation, information: np.ndarray, seen: Evidence
    ) -> TrackedPose:
        r"""The pose with its covariance by the images alone; what they do not show is uncertain, not infinite.

        Of this image's noise a share s is the last one's still, a share p that of ten images ago. What is new in an
        image is averaged with those before (``Expectation.averaged``), the rest is not:

            S = s R + (1 - s) A + floor,    R = (L + weak)^-1 of this image alone.

        The time for which the errors stay alike is the mean of the parts' own, by their share of S.
        """
        unlikely = max(seen.misfit, 1.0)
        alone = np.linalg.inv(information / unlikely + WEAK * self._shape.prior)
        if not information.any():
            return TrackedPose(expected.T_wo, alone, seen.visible_fraction, "ok")
        lingering, lasting = self._noise.lingering, self._noise.persistence
        averaged = unlikely * expected.averaged
        covariance = lingering * alone + (1.0 - lingering) * averaged
        share = np.linalg.inv(covariance) / 6.0
        of_image, of_images = np.trace(share @ alone), np.trace(share @ averaged)
        correlation = of_image * (lasting * LASTING + (lingering - lasting) * APART[-1] * IMAGE)
        correlation += of_images * (1.0 - lingering) * expected.images_alike * IMAGE
        return TrackedPose(
            expected.T_wo,
            covariance + np.diag(FLOOR),
            seen.visible_fraction,
            "ok",
            float(correlation),
        )

    def _follow(
        self, view: View, T_co: gtsam.Pose3, prior: np.ndarray | None = None
    ) -> tuple[gtsam.Pose3, Evidence]:
        """The pose near ``T_co``, and what the image says of it."""
        outline = outline_pixels(self._shape, view, T_co)
        coarse = view.strided(stride(outline, COARSE_PIXELS))
        T_co_now = align(self._shape, coarse, T_co, 4, T_co, prior)
        T_co_now = align(self._shape, view, T_co_now, 2, T_co, prior)
        return T_co_now, Evidence(self._shape, view, T_co_now)

    def _meets(self, seen: Evidence, demand: Demand) -> bool:
        return (
            seen.visible_fraction >= demand.visible_fraction
            and seen.contradiction <= demand.contradiction
            and seen.misfit <= demand.misfit
        )

    def _around(self, T_co: gtsam.Pose3, T_co_hint: gtsam.Pose3 | None) -> tuple[np.ndarray, float]:
        """Points that the view must show [m], shape (N, 3), camera frame, and the margin around them [m]."""
        poses = [T_co] if T_co_hint is None else [T_co, T_co_hint]
        corners_c = np.concatenate([T.transformFrom(self._shape.corners_o.T).T for T in poses])
        if not self._search.images:
            return corners_c, MARGIN
        center_c = corners_c.mean(axis=0)  # lost, it may have turned to any side
        radius = np.linalg.norm(corners_c - center_c, axis=1).max()
        return np.array([center_c]), radius + MARGIN + 2.0 * self._search.spread[1]
