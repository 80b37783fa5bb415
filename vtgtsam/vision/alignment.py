# SPDX-License-Identifier: MIT
"""How well an object's pose agrees with a depth image, and the step that makes it agree better.

The pose is judged by predicting the object's depth image at it. Each measured pixel then says one thing: it is
the object's surface, or it shows that the camera sees through the modelled object (evidence against the pose),
or the object is covered there (which says nothing).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import gtsam
import numpy as np

from . import kernels
from .camera import CameraIntrinsics

if TYPE_CHECKING:
    from ..sdf.grid import GridSdf

SINGLE = 3.5  # [sigma], a pixel that differs more from the prediction is not the surface
MEAN = 0.5  # [sigma], the same for the mean over a window
WINDOW = 2  # [pixels], how far such a window reaches to each side
CUTOFF = 3.0  # [sigma], Tukey's
SLACK = 0.0015  # [m], what grid and mesh may be off; added to all of these


class Shape:
    """An object as the tracker sees it.

    Attributes:
        grid: Values, lower corner and scale of its distance field, as the kernels take them.
        box: Two corners around it [m], shape (2, 3), object frame.
        center_o: Centre of that box [m], shape (3,).
        radius: Radius of a sphere about the centre that holds it [m].
    """

    def __init__(self, sdf: GridSdf) -> None:
        self.grid = (sdf.values, sdf.lower, sdf.scale)
        # Half a cell more than the inside, so that walls thinner than a cell count.
        nodes = np.argwhere(np.asarray(sdf.values <= sdf.spacing.max() / 2))
        inside = nodes.astype(np.float64) / sdf.scale + sdf.lower
        self.box = np.array([inside.min(axis=0) - sdf.spacing, inside.max(axis=0) + sdf.spacing])
        self.center_o: np.ndarray = self.box.mean(axis=0)
        self.radius = float(np.linalg.norm(inside - self.center_o, axis=1).max())


@dataclass(frozen=True, eq=False)
class View:
    """The part of a depth image around the object.

    Attributes:
        depth: Measured depth [m], shape (height, width), 0 where there is none.
        hand: Where the hand is known to be, same shape.
        camera: Its intrinsics.
        sigma: Standard deviation of the depth's noise [m].
    """

    depth: np.ndarray
    hand: np.ndarray
    camera: CameraIntrinsics
    sigma: float

    def strided(self, step: int) -> View:
        """Every ``step``-th row and column of it."""
        return View(
            np.ascontiguousarray(self.depth[::step, ::step]),
            np.ascontiguousarray(self.hand[::step, ::step]),
            self.camera.strided(step),
            self.sigma,
        )


class Evidence:
    """What an image says about one pose.

    Args:
        shape: The object.
        view: The image.
        T_co: The pose to judge, object in camera.
        beside: Weight of measured points beside the object's outline, in [0, 1].

    Attributes:
        information: Of a right perturbation [rotation, translation] of the pose, shape (6, 6).
        gradient: Of half the sum of squares, same order, shape (6,).
        outline: Number of pixels where the pose puts the object.
        surface: Number of those which show its surface there.
        through: Number of those which show something behind it.
    """

    def __init__(self, shape: Shape, view: View, T_co: gtsam.Pose3, beside: float) -> None:
        T_oc = T_co.inverse()
        camera = view.camera
        pose = (
            np.array([camera.fx, camera.fy, camera.cx, camera.cy]),
            T_oc.rotation().matrix(),
            np.asarray(T_oc.translation()),
        )
        predicted = np.empty(view.depth.shape)
        kernels.render(*shape.grid, shape.box, *pose, predicted)
        self.kind = np.empty(view.depth.shape, dtype=np.uint8)
        single, mean = SINGLE * view.sigma + SLACK, MEAN * view.sigma + SLACK
        kernels.classify(predicted, view.depth, view.hand, single, mean, WINDOW, self.kind)
        self.information, self.gradient = np.zeros((6, 6)), np.zeros(6)
        kernels.accumulate(
            *shape.grid,
            shape.box,
            *pose,
            view.depth,
            predicted,
            self.kind,
            view.sigma,
            CUTOFF * view.sigma + SLACK,
            beside,
            self.information,
            self.gradient,
        )
        counts = np.bincount(self.kind.ravel(), minlength=5)
        self.outline = int(np.count_nonzero(predicted < np.inf))
        self.surface = int(counts[kernels.SURFACE])
        self.through = int(counts[kernels.THROUGH])

    @property
    def visible_fraction(self) -> float:
        """Share of the outline in which the object's surface is seen."""
        return self.surface / max(self.outline, 1)


def noise_of(depth: np.ndarray) -> float:
    """Standard deviation of a depth image's noise [m], from the second differences along its rows.

    Surfaces are smooth over three pixels, noise is not: for independent noise a second difference has
    variance 6 sigma^2. The median does not mind edges. 0 where nothing was measured.
    """
    first, middle, last = depth[:, :-2], depth[:, 1:-1], depth[:, 2:]
    measured = (first > 0.0) & (middle > 0.0) & (last > 0.0)
    if not measured.any():
        return 0.0
    second = np.abs(first - 2.0 * middle + last)[measured]
    return float(1.4826 * np.median(second) / np.sqrt(6.0))
