# SPDX-License-Identifier: MIT
"""How well an object's pose agrees with a depth image, and the steps that make it agree better.

The pose is judged by predicting the object's depth image at it. Each measured pixel then says one thing: it is
the object's surface, or it shows that the camera sees through the modelled object (evidence against the pose),
or the object is covered there (which says nothing), or, where the hand is known and cannot be what covers it, that
the object is nearer than the pose says.
"""

from __future__ import annotations

import itertools
from functools import cached_property
from typing import TYPE_CHECKING

import gtsam
import numpy as np
from scipy import linalg

from . import kernels, ray_kernels
from .contour import Contour
from .view import View

if TYPE_CHECKING:
    from ..sdf.grid import GridSdf

SINGLE = 3.5  # [sigma], a pixel that differs more from the prediction is not the surface
MEAN = (
    0.5  # [sigma], the same for the mean over a window, whose own noise is sigma / 5 if independent
)
WINDOW = 2  # [pixels], how far such a window reaches to each side
CUTOFF = 3.0  # [sigma], Tukey's
COMMON = 0.5  # share of what edges add to the noise that is the same along all of them
ROOM = 0.0015  # [m], added to these three: what the pose may be off before the first step
SLACK = 0.0005  # [m], what grid and mesh are off even at the right pose
NORMAL_SIGMA = 0.1  # [rad], what the normals of grid and mesh are off
FEIGNED = 2.0  # as often as that it may feign what is not there
NOTHING = 1e-6  # of what STEP_SIGMA tells, so that an image without points feigns something
GRAZING = 0.4  # sine of the angle; a surface seen at a flatter one counts no more for it
STEP_SIGMA = np.array([0.05, 0.05, 0.05, 0.01, 0.01, 0.01])  # [rad, m], motion between two frames
CONVERGED = (5e-4, 2e-5)  # [rad, m], a step below which another one changes nothing


class Shape:
    """An object as the tracker sees it.

    Attributes:
        grid: Values, lower corner and scale of its distance field, as the kernels take them.
        box: Two opposite corners of a box around it [m], shape (2, 3), object frame.
        corners_o: All corners of that box [m], shape (8, 3).
        center_o: Centre of that box [m], shape (3,).
        prior: Information of a pose known to ``STEP_SIGMA`` at that centre, shape (6, 6), for a right
            perturbation [rotation, translation] of the object frame.
    """

    def __init__(self, sdf: GridSdf) -> None:
        self.grid: tuple[np.ndarray, np.ndarray, np.ndarray] = (sdf.values, sdf.lower, sdf.scale)
        # Half a cell more than the inside, so that walls thinner than a cell count.
        nodes = np.argwhere(np.asarray(sdf.values <= sdf.spacing.max() / 2))
        inside = nodes.astype(np.float64) / sdf.scale + sdf.lower
        self.box = np.array([inside.min(axis=0) - sdf.spacing, inside.max(axis=0) + sdf.spacing])
        self.center_o: np.ndarray = self.box.mean(axis=0)
        self.corners_o = np.array(list(itertools.product(*self.box.T)))
        to_center = self.to_center()
        self.prior: np.ndarray = to_center.T @ np.diag(1.0 / STEP_SIGMA**2) @ to_center

    def to_center(self) -> np.ndarray:
        """Matrix (6, 6) from a perturbation of the object frame to that of a frame at its centre."""
        matrix = np.eye(6)
        matrix[3:, :3] = -gtsam.Rot3.Hat(self.center_o)
        return matrix


class Evidence:
    """What an image says about one pose.

    Args:
        shape: The object.
        view: The image.
        T_co: The pose to judge, object in camera.

    Attributes:
        predicted: Depth of the object alone at that pose [m], inf where it is not, shape (height, width).
        kind: What each pixel says, as the kernels number it, same shape.
        outline: Number of pixels where the pose puts the object.
        surface: Number of those which show its surface there.
        through: Number of those which show something behind it.
        measured: Number of those which show anything.
        misfit: How much larger the surface's smooth deviations (squared) are than noise and model let
            expect; about 1 at the right pose, larger on a surface that is not the object's.
    """

    def __init__(self, shape: Shape, view: View, T_co: gtsam.Pose3) -> None:
        self._shape, self._view = shape, view
        camera, T_oc = view.camera, T_co.inverse()
        self._pose = (
            np.array([camera.fx, camera.fy, camera.cx, camera.cy]),
            T_oc.rotation().matrix(),
            np.asarray(T_oc.translation()),
        )
        self.predicted = np.empty(view.depth.shape)
        ray_kernels.render(*shape.grid, shape.box, *self._pose, self.predicted)
        self.kind = np.empty(view.depth.shape, dtype=np.uint8)
        limits = np.array([SINGLE, MEAN, ROOM, SLACK])
        alike = float(np.prod(np.minimum(view.correlation, 2 * WINDOW + 1)))
        self.misfit = float(
            kernels.classify(
                self.predicted,
                view.depth,
                view.hand,
                view.hand_depth if view.hand_is_known else np.full_like(view.hand_depth, -np.inf),
                view.sigma,
                view.excess,
                alike,
                limits,
                WINDOW,
                self.kind,
            )  # fmt: skip
        )
        counts = np.bincount(self.kind.ravel(), minlength=5)
        self.outline = int(np.count_nonzero(self.predicted < np.inf))
        self.measured = int(counts[1:].sum())
        self.surface = int(counts[kernels.SURFACE])
        self.through = int(counts[kernels.THROUGH])

    @property
    def visible_fraction(self) -> float:
        """Share of the outline in which the object's surface is seen."""
        return self.surface / max(self.outline, 1)

    @property
    def contradiction(self) -> float:
        """Share of pixels against the pose among those for or against it; 1 where there are none."""
        return self.through / (self.surface + self.through) if self.surface else 1.0

    def normal_equations(self) -> tuple[np.ndarray, np.ndarray]:
        """Information (6, 6) and gradient (6,) of half the weighted sum of squares.

        Both are for a right perturbation [rotation, translation] of the pose. Pixels that err together count
        as one, and what edges have in common is eliminated (Schur complement).
        """
        information, gradient, _ = self._sums
        return information, gradient

    def credible(self) -> np.ndarray:
        r"""The same information, less the rotation that errors of the surface's normals feign, shape (6, 6).

        How a ball is turned, or a can about its axis, is not seen. But where normals n are off a little, each pixel
        feigns that it is. Its row for a rotation about the object's centre is (n x s)^T, with the point s from there,
        so that errors of ``NORMAL_SIGMA`` in n add

            F = NORMAL_SIGMA^2 \sum w (|s|^2 I - s s^T)

        S is what the image says of the rotation whatever the translation (Schur complement). Along each v with
        S v = lambda F v, what exceeds F is credible: lambda - FEIGNED in the place of lambda.
        """
        information, _, moments = self._sums
        to_center, least = self._shape.to_center(), NOTHING / STEP_SIGMA**2
        from_center = np.linalg.inv(to_center)
        at_center = from_center.T @ information @ from_center
        across, translation = at_center[:3, 3:], at_center[3:, 3:] + np.diag(least[3:])
        rotation = at_center[:3, :3] - across @ np.linalg.solve(translation, across.T)
        feigned = NORMAL_SIGMA**2 * _turned(moments, self._shape.center_o) + np.diag(least[:3])
        ratio, directions = linalg.eigh(rotation, feigned)
        # The rotation's information is the sum of ratio rows^T rows.
        rows = (feigned @ directions).T
        at_center[:3, :3] -= (rows.T * np.minimum(ratio, FEIGNED)) @ rows
        credible: np.ndarray = to_center.T @ at_center @ to_center
        return credible

    @cached_property
    def normals_c(self) -> np.ndarray:
        """Unit normals of the predicted surface, camera frame, NaN beside it, shape (height, width, 3)."""
        normals_c = np.empty((*self.predicted.shape, 3))
        ray_kernels.normals(*self._shape.grid, *self._pose, self.predicted, normals_c)
        return normals_c

    @cached_property
    def contour(self) -> Contour:
        """The outline in the view's infrared image."""
        return Contour(self._shape, self._view, self._pose, self.predicted, self.normals_c)

    @cached_property
    def _sums(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Information (6, 6), gradient (6,), and the weighted sum of [s; 1] [s; 1]^T of the surface's points (4, 4)."""
        information, gradient, moments = np.zeros((7, 7)), np.zeros(7), np.zeros((4, 4))
        kernels.accumulate(
            *self._shape.grid,
            *self._pose,
            self._view.depth,
            self.predicted,
            self.kind,
            self._view.sigma,
            self._view.excess,
            GRAZING,
            np.array([CUTOFF, ROOM]),
            COMMON,
            information,
            gradient,
            moments,
        )
        together = float(np.prod(self._view.correlation))
        information, gradient, moments = (x / together for x in (information, gradient, moments))
        common = information[:6, 6] / (1.0 + information[6, 6])
        by_depth = (
            information[:6, :6] - np.outer(common, information[:6, 6]),
            gradient[:6] - common * gradient[6],
            moments,
        )
        if self._view.infrared is None:
            return by_depth
        by_outline = self.contour.normal_equations()
        information, gradient, moments = (a + b for a, b in zip(by_depth, by_outline, strict=True))
        return information, gradient, moments


def _turned(moments: np.ndarray, center: np.ndarray) -> np.ndarray:
    """The sum of w (|s|^2 I - s s^T), shape (3, 3), of points s from a centre, by the moments of [s; 1]."""
    to_center = np.eye(4)
    to_center[:3, 3] = -center
    squares = (to_center @ moments @ to_center.T)[:3, :3]
    whole: np.ndarray = np.trace(squares) * np.eye(3) - squares
    return whole


def outline_pixels(shape: Shape, view: View, T_co: gtsam.Pose3) -> int:
    """About how many pixels of the image the object takes at a pose, covered or not."""
    return Evidence(shape, view.strided(4), T_co).outline * 16


def stride(outline: int, pixels: int) -> int:
    """Which part of an image's rows and columns leaves so many pixels of an outline, or a few more."""
    return max(1, int(np.sqrt(outline / pixels)))


def align(
    shape: Shape,
    view: View,
    start: gtsam.Pose3,
    iterations: int,
    T_co_expected: gtsam.Pose3 | None = None,
    prior: np.ndarray | None = None,
) -> gtsam.Pose3:
    """The pose T_co near ``start`` that agrees best with the image, by Gauss-Newton steps.

    A prior holds what the image does not show: a can does not spin about its axis.

    Args:
        shape: The object.
        view: The image.
        start: Where the steps begin.
        iterations: How many at most.
        T_co_expected: Where the object is expected without the image; None: at ``start``.
        prior: How surely, information (6, 6) of that pose; None: the shape's, which is weak.
    """
    T_co, expected = start, start if T_co_expected is None else T_co_expected
    prior = shape.prior if prior is None else prior
    for _ in range(iterations):
        information, gradient = Evidence(shape, view, T_co).normal_equations()
        away = expected.localCoordinates(T_co)
        step = -np.linalg.solve(information + prior, gradient + prior @ away)
        T_co = T_co.retract(step)
        if abs(step[:3]).max() < CONVERGED[0] and abs(step[3:]).max() < CONVERGED[1]:
            break
    return T_co
