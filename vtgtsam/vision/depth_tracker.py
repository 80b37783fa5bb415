# SPDX-License-Identifier: MIT
"""A model tracker that needs nothing but depth images."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import gtsam
import numpy as np

from . import kernels
from .camera import CameraIntrinsics
from .hand_mask import HandMask
from .tracker import TrackedPose

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..hand import HandModel
    from ..objects import ObjectModel
    from ..sdf.grid import GridSdf

MARGIN = 0.02  # [m], around the object's bounding sphere: what it may move between two frames
BESIDE = 0.05  # weight of points beside the outline, which may as well be the hand's
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

    Each iteration predicts the object's depth image at the current pose and lets each measured pixel say one
    thing: it is the object's surface, it shows that the camera sees through the modelled object, or the object
    is covered there, which says nothing.

    Args:
        obj: The object; only its distance field is used.
        camera: Intrinsics of the depth images.
        hand: None for a tracker that knows nothing of the hand (form "depth"); else the hand's pixels are
            removed by its geometry at the joint angles given with each image (form "depth-hand").
        iterations: Gauss-Newton steps a frame.
    """

    def __init__(
        self,
        obj: ObjectModel,
        camera: CameraIntrinsics,
        hand: HandModel | None = None,
        iterations: int = 5,
    ) -> None:
        self.camera = camera
        self.iterations = iterations
        self._sdf = obj.sdf
        self._center_o, self._radius = bounding_sphere(obj)
        self._hand = None if hand is None else HandMask(hand)
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
        depth = self.camera.check(depth)
        left, top, right, bottom = self._window(T_wc.inverse() * self._T_wo)
        view = self.camera.cropped(left, top, right - left, bottom - top)
        image = np.ascontiguousarray(depth[top:bottom, left:right])
        if self._hand is not None:
            if joints is None:
                raise ValueError("a tracker that knows the hand needs its joint angles each frame")
            T_hc = (T_wh or gtsam.Pose3()).inverse() * T_wc
            image[self._hand.mask(image, view, T_hc, joints)] = 0.0
        return self._align(image, view, T_wc)

    def _align(self, image: np.ndarray, view: CameraIntrinsics, T_wc: gtsam.Pose3) -> TrackedPose:
        assert self._T_wo is not None
        if image.size == 0:
            return TrackedPose.lost()
        sigma = max(noise_of(image), 0.5e-3)
        prior = np.diag(1.0 / PRIOR_SIGMA**2)
        T_wo = start = self._T_wo
        for _ in range(self.iterations):
            seen = Seen(self._sdf, image, view, T_wo.inverse() * T_wc, sigma)
            step = start.localCoordinates(T_wo)
            delta = np.linalg.solve(seen.information + prior, -(seen.gradient + prior @ step))
            T_wo = T_wo.retract(delta)
        self._T_wo = T_wo
        return TrackedPose(
            T_wo, np.linalg.inv(seen.information + 1e-2 * prior), seen.visible_fraction, "ok"
        )

    def _window(self, T_co: gtsam.Pose3) -> tuple[int, int, int, int]:
        """Pixels (left, top, right, bottom) around the object's bounding sphere."""
        center = T_co.transformFrom(self._center_o)
        reach = self._radius + MARGIN
        u, v = self.camera.project(center[None])[0]
        half = reach / max(center[2] - reach, 0.01)
        left, right = u - half * self.camera.fx, u + half * self.camera.fx + 1
        top, bottom = v - half * self.camera.fy, v + half * self.camera.fy + 1
        width, height = self.camera.width, self.camera.height
        return (
            int(np.clip(left, 0, width)),
            int(np.clip(top, 0, height)),
            int(np.clip(right, 0, width)),
            int(np.clip(bottom, 0, height)),
        )


class Seen:
    """What an image says about one pose: the normal equations and how much of the object is seen.

    Args:
        sdf: The object's distance field.
        image: Depth image [m], 0 where nothing was measured.
        view: The image's intrinsics.
        T_oc: Pose of the camera in the object frame, i.e. the pose to judge.
        sigma: Standard deviation of the image's noise [m].
    """

    def __init__(
        self,
        sdf: GridSdf,
        image: np.ndarray,
        view: CameraIntrinsics,
        T_oc: gtsam.Pose3,
        sigma: float,
    ) -> None:
        grid = (sdf.values, sdf.lower, sdf.scale)
        pose = (
            np.array([view.fx, view.fy, view.cx, view.cy]),
            T_oc.rotation().matrix(),
            np.asarray(T_oc.translation()),
        )
        predicted = np.empty(image.shape)
        kernels.render(*grid, *pose, predicted)
        self.kind = np.empty(image.shape, dtype=np.uint8)
        behind, front = 2.0 * sigma + 0.002, 0.8 * sigma + 0.002
        kernels.classify(predicted, image, behind, front, 2, self.kind)
        self.information, self.gradient = np.zeros((6, 6)), np.zeros(6)
        kernels.accumulate(
            *grid,
            *pose,
            image,
            predicted,
            self.kind,
            sigma,
            3.0 * sigma + 0.001,
            BESIDE,
            self.information,
            self.gradient,
        )
        outline = np.count_nonzero(np.isfinite(predicted))
        surface = np.count_nonzero(self.kind == kernels.SURFACE)
        self.visible_fraction = surface / max(outline, 1)


def bounding_sphere(obj: ObjectModel) -> tuple[np.ndarray, float]:
    """Centre [m], shape (3,), and radius [m] of a sphere around the object."""
    sdf = obj.sdf
    # Half a cell more than the inside, so that walls thinner than a cell count.
    nodes = np.argwhere(np.asarray(sdf.values <= sdf.spacing.max() / 2))
    inside = nodes.astype(np.float64) / sdf.scale + sdf.lower
    center = (inside.min(axis=0) + inside.max(axis=0)) / 2
    return center, float(np.linalg.norm(inside - center, axis=1).max())


def noise_of(image: np.ndarray) -> float:
    """Standard deviation of a depth image's noise [m], from the second differences along its rows.

    Surfaces are smooth over three pixels, noise is not: for independent noise a second difference has
    variance 6 sigma^2. The median does not mind edges.
    """
    first, middle, last = image[:, :-2], image[:, 1:-1], image[:, 2:]
    measured = (first > 0.0) & (middle > 0.0) & (last > 0.0)
    if not measured.any():
        return 0.0
    second = np.abs(first - 2.0 * middle + last)[measured]
    return float(1.4826 * np.median(second) / np.sqrt(6.0))
