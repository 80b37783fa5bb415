# SPDX-License-Identifier: MIT
r"""Whether the hand is where the wrist calibration puts it, seen in a depth image.

The hand's model at its joint angles, put at T_ch, predicts a depth for each pixel. The pose that agrees best with
the image is searched near T_ch; what lies between both is the calibration's error, and that of the joints' zeros:

    min over xi of  sum over pixels of  min(max(r, 0), c)^2 + r^2 where -c < r < 0,      r = d - d_hand(T_ch, xi)

xi turns and shifts the hand about its middle in the camera frame. A pixel in which something is nearer than the
hand by more than c says nothing: it covers the hand. One in which the image looks past where the hand should be
counts as c.
"""

from __future__ import annotations

from dataclasses import dataclass

import gtsam
import numpy as np

from vtgtsam import HandModel
from vtgtsam.camera import CameraIntrinsics
from vtgtsam.vision.hand_mask import HandMask

from .camera import CameraError
from .wrist import TagMount

MAX_TRANSLATION = (
    0.008  # [m], of the hand's middle; a RealSense camera is off by 2 to 4 mm at 0.6 m
)
MAX_ROTATION = np.deg2rad(2.0)  # [rad]
_CUTS = (0.05, 0.02, 0.01)  # [m], c from the first search to the last
_STEPS = 8  # of each search
_SCALE = np.array([0.02] * 3 + [0.003] * 3)  # [rad, m], of differences; edges must move by a pixel
_OTHER_SIZE = (
    0.015  # share by which hand and tag differ in distance, where the tag's size is the cause
)
_DONE = 0.01  # of _SCALE, a step that ends a search
_MARGIN = 0.05  # [m], around the hand's pixels
_PIXELS = 5_000  # about so many rays
_SEEN = 0.5  # of the hand's pixels that nothing covers must show it ...
_UNCOVERED = 0.2  # ... and of all


@dataclass(frozen=True, eq=False)
class HandView:
    """Where a depth image shows the hand.

    Attributes:
        T_ch: The pose that agrees best with the image.
        translation: Distance of the hand's middle from where it was taken to be [m].
        rotation: Angle from how it was taken to lie [rad].
        nearer: Distance of the middle from the camera, divided by what it was taken for.
        seen: Share of the hand's uncovered pixels that show it at the best pose.
    """

    T_ch: gtsam.Pose3
    translation: float
    rotation: float
    nearer: float
    seen: float

    @property
    def text(self) -> str:
        """For people."""
        return f"{1000 * self.translation:.1f} mm and {np.rad2deg(self.rotation):.1f} degrees"

    @property
    def agrees(self) -> bool:
        """Whether the difference is no greater than the camera's own errors."""
        return self.translation <= MAX_TRANSLATION and self.rotation <= MAX_ROTATION


def find_hand(
    depth: np.ndarray,
    camera: CameraIntrinsics,
    hand: HandModel,
    joints: np.ndarray,
    T_ch: gtsam.Pose3,
) -> HandView:
    """Where a depth image [m], shape (H, W), shows the hand near T_ch.

    Args:
        depth: The image; 0 where nothing was measured.
        camera: Its intrinsics.
        hand: The hand.
        joints: Its joint angles, in the model's order [rad].
        T_ch: Where it is taken to be.

    Raises:
        CameraError: The hand is not in the image, or the image does not show it there.
    """
    search = _Search(depth, camera, hand, joints, T_ch)
    T = T_ch
    for cut in _CUTS:
        T = search.refine(T, cut)
    seen, uncovered = search.seen(T, _CUTS[-1])
    if seen < _SEEN or uncovered * seen < _UNCOVERED:
        raise CameraError(
            "the depth image does not show the hand near where the wrist calibration puts it: "
            f"{100 * uncovered:.0f} % of its pixels are uncovered, {100 * seen:.0f} % of those agree at best. Was "
            "camera or hand moved since `calibrate-wrist`, is the hand covered, or are zeros or signs of its "
            "joints wrong?"
        )
    before, after = T_ch.transformFrom(search.middle_h), T.transformFrom(search.middle_h)
    turned = gtsam.Rot3.Logmap(T_ch.rotation().between(T.rotation()))
    return HandView(
        T_ch=T,
        translation=float(np.linalg.norm(after - before)),
        rotation=float(np.linalg.norm(turned)),
        nearer=float(np.linalg.norm(after) / np.linalg.norm(before)),
        seen=seen,
    )


def check_hand_view(
    depth: np.ndarray,
    camera: CameraIntrinsics,
    hand: HandModel,
    joints: np.ndarray,
    T_ch: gtsam.Pose3,
) -> str:
    """A sentence on how far the hand is from where the wrist calibration puts it; arguments as of ``find_hand``.

    Raises:
        CameraError: Too far.
    """
    view = find_hand(depth, camera, hand, joints, T_ch)
    if not view.agrees:
        raise CameraError(
            f"the depth image shows the hand {view.text} from where the wrist calibration and its joints put it (at "
            f"most {1000 * MAX_TRANSLATION:.0f} mm and {np.rad2deg(MAX_ROTATION):.0f} degrees are accepted): repeat "
            "`calibrate-wrist`; if it stays so, check the tag's size and T_ht, and the joints' zeros"
        )
    return f"the depth image shows the hand {view.text} from where the wrist calibration puts it"


def compare_with_depth(
    T_ch: gtsam.Pose3,
    depth: np.ndarray,
    camera: CameraIntrinsics,
    hand: HandModel,
    joints: np.ndarray,
    mount: TagMount,
) -> str:
    """A sentence on how far the depth image shows the hand from where its tag puts it.

    Args:
        T_ch: The hand's pose by its tag.
        depth: The image [m].
        camera: Its intrinsics.
        hand: The hand.
        joints: Its joint angles, in the model's order [rad].
        mount: The tag and its place on the hand.

    Raises:
        CameraError: Too far, with the likely cause; or the image does not show the hand.
    """
    view = find_hand(depth, camera, hand, joints, T_ch)
    text = f"the depth image shows the hand {view.text} from where the tag puts it"
    if view.agrees:
        return text
    size = 1000 * mount.size
    if abs(view.nearer - 1.0) > _OTHER_SIZE and view.rotation < MAX_ROTATION:
        raise CameraError(
            f"{text}, {100 * abs(view.nearer - 1):.0f} % {'nearer' if view.nearer < 1 else 'farther'}: is the side of "
            f"its black square {size * view.nearer:.1f} mm in place of the {size:.1f} mm in the hand's file? Measure it"
        )
    raise CameraError(
        f"{text}: correct T_ht, the tag's place on the hand, in the hand's file; tilt the tag by 30 degrees or more "
        "against the camera; check the joints' zeros (`python -m hardware joints`)"
    )


class _Search:
    """One image, in which the hand is looked for."""

    def __init__(
        self,
        depth: np.ndarray,
        camera: CameraIntrinsics,
        hand: HandModel,
        joints: np.ndarray,
        T_ch: gtsam.Pose3,
    ) -> None:
        self._mask, self._joints = HandMask(hand), joints
        whole = self._mask.depth(camera, T_ch.inverse(), joints)
        shown = np.isfinite(whole)
        if not shown.any():
            raise CameraError(
                "the hand is not in the camera's image by the wrist calibration: repeat it"
            )
        points_c = camera.back_project(np.where(shown, whole, 0.0))
        self.middle_h = T_ch.transformTo(points_c.mean(axis=0))
        margin = round(_MARGIN * camera.fx / float(points_c[:, 2].mean()))
        rows, columns = np.flatnonzero(shown.any(axis=1)), np.flatnonzero(shown.any(axis=0))
        top, left = max(rows[0] - margin, 0), max(columns[0] - margin, 0)
        bottom = min(rows[-1] + margin + 1, camera.height)
        right = min(columns[-1] + margin + 1, camera.width)
        stride = max(1, round(np.sqrt((bottom - top) * (right - left) / _PIXELS)))
        self._camera = camera.cropped(left, top, right - left, bottom - top).strided(stride)
        self._depth = depth[top:bottom:stride, left:right:stride]

    def refine(self, T_ch: gtsam.Pose3, cut: float) -> gtsam.Pose3:
        """The best pose near one, by damped Gauss-Newton steps with differences."""
        r, damping = self._residuals(T_ch, cut), 1e-3
        for _ in range(_STEPS):
            columns = []
            for k in range(6):
                step = np.zeros(6)
                step[k] = _SCALE[k]
                ahead = self._residuals(self._moved(T_ch, step), cut)
                behind = self._residuals(self._moved(T_ch, -step), cut)
                columns.append((ahead - behind) / 2)
            J = np.column_stack(columns)
            H = J.T @ J
            xi = -_SCALE * np.linalg.solve(H + damping * np.diag(np.diag(H) + 1e-12), J.T @ r)
            candidate = self._moved(T_ch, xi)
            trial = self._residuals(candidate, cut)
            if trial @ trial < r @ r:
                T_ch, r, damping = candidate, trial, damping / 3
            else:
                damping *= 10
            if np.abs(xi / _SCALE).max() < _DONE:
                break
        return T_ch

    def seen(self, T_ch: gtsam.Pose3, cut: float) -> tuple[float, float]:
        """Of the hand's measured pixels that nothing covers the share that agrees within ``cut`` [m]; their share."""
        difference = self._depth - self._predicted(T_ch)
        shown = difference[np.isfinite(difference) & (self._depth > 0)]
        open_ = shown[shown > -cut]
        if not len(open_):
            return 0.0, 0.0
        return float(np.mean(open_ < cut)), len(open_) / len(shown)

    def _moved(self, T_ch: gtsam.Pose3, xi: np.ndarray) -> gtsam.Pose3:
        middle_c = T_ch.transformFrom(self.middle_h)
        turn = gtsam.Rot3.Expmap(xi[:3])
        T = gtsam.Pose3(turn, middle_c + xi[3:] - turn.matrix() @ middle_c)
        return T * T_ch

    def _predicted(self, T_ch: gtsam.Pose3) -> np.ndarray:
        return self._mask.depth(self._camera, T_ch.inverse(), self._joints)

    def _residuals(self, T_ch: gtsam.Pose3, cut: float) -> np.ndarray:
        difference = self._depth - self._predicted(T_ch)
        known = np.isfinite(difference) & (self._depth > 0) & (difference > -cut)
        return np.where(known, np.minimum(difference, cut), 0.0).ravel()
