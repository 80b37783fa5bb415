# SPDX-License-Identifier: MIT
r"""What an infrared image says of the object's outline.

Depth shows how far a surface is, not where it ends: a flat face may slide along itself, and a stereo camera's depth
fattens what is near by some pixels. The outline in the infrared image is sharp. So lines of pixels are laid across it
where the pose puts it, and each says where along it the object ends, with mean m and variance v (``edge_kernels``).
With the outline's point p_o there, its pixel pi(p_c), p_c = T_co p_o, and the line's direction n,

    e = n . pi(p_c) - m,    de/dxi = [ (p_o x a)^T  a^T ],    a = R_co^T (d pi / d p_c)^T n

p_o may be taken as fixed: as the object turns, it slides along the ray, which the image does not show. The model,
lines across a predicted outline with a posterior each, is that of Stoiber et al., "SRT3D: A Sparse Region-Based 3D
Object Tracking Approach for the Real World", IJCV 2022, and, beside depth, of "Iterative Corresponding Geometry", CVPR
2022. What is known of the two sides differs: the object's brightness follows its normals (``shading``), and that of
what lies beside it is not needed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from . import contour_kernels, edge_kernels, kernels

if TYPE_CHECKING:
    from .alignment import Evidence, Shape
    from .view import View

REACH, SEARCH = 8, 5  # [pixels], of a line to each side, and of the places that are tried on it
BESIDE = 1  # [pixels], so many lines to each side are averaged
THICK = 6  # [pixels], where the object is thinner there is too little of it to know it by
CLEAR, FREE = (
    3,
    2,
)  # [pixels], around a point, and around a line's pixel, the hand must not be in front
FLOOR = 0.5  # [pixels], standard deviation of what grid, mesh and the lens are off
CUTOFF = 3.0  # [pixels], an error so large counts a quarter (Geman and McClure)
COMMON = 0.5  # [pixels], standard deviation of what all outlines are off outward
MOST = 4000  # lines


class Contour:
    """The outline of an object at a pose, in a view with an infrared image.

    Args:
        shape: The object.
        view: The image.
        pose: The view's camera (fx, fy, cx, cy), R_oc and t_oc, as the kernels take them.
        predicted: Depth of the object alone at that pose [m].
        normals_c: Its normals there, camera frame, NaN where it is not, shape (height, width, 3).

    Attributes:
        points_o: Points of it that nothing covers [m], shape (N, 3).
        pixels: Where they are in the infrared image, shape (N, 2).
        normals: Its normals in the image, outward, shape (N, 2).
        places: Mean [pixels] and variance [pixels^2] of where the image shows it, outward from there, shape (N, 2).
    """

    def __init__(
        self,
        shape: Shape,
        view: View,
        pose: tuple[np.ndarray, np.ndarray, np.ndarray],
        predicted: np.ndarray,
        normals_c: np.ndarray,
    ) -> None:
        assert view.infrared is not None
        self._infrared, self._step = view.infrared, view.infrared.step
        camera, self._R_oc, self._t_oc = pose
        self._alike = self._step * self._infrared.shading.alike
        self._focal = self._step * camera[:2]  # of the image, not of the view
        points_o, pixels, normals, depths = (np.empty((MOST, n)) for n in (3, 2, 2, 1))
        count = contour_kernels.outline(
            *shape.grid,
            *pose,
            predicted,
            view.hand_depth,
            self._in_view(CLEAR),
            points_o,
            pixels,
            normals,
            depths[:, 0],
        )
        self.points_o, self.normals = points_o[:count], normals[:count]
        self.pixels = self._step * pixels[:count]
        shade = self._infrared.shading.of(normals_c)
        self.places = self._found(view.hand_depth, depths[:count, 0], shade)

    def _in_view(self, pixels: int) -> int:
        """So many pixels of the image, in the view."""
        return max(1, round(pixels / self._step))

    def _found(self, hand_depth: np.ndarray, depths: np.ndarray, shade: np.ndarray) -> np.ndarray:
        lines, weights = np.empty((2, len(depths), 2 * REACH + 1))
        front = ndimage.minimum_filter(hand_depth, size=2 * self._in_view(FREE) + 1)
        crossing = (self._step, self.pixels, self.normals)
        brightness, shading = self._infrared.brightness, self._infrared.shading
        contour_kernels.across(brightness, front, *crossing, depths, BESIDE, lines, weights)
        expected = np.full((len(depths), REACH + SEARCH + 2), np.nan)
        thickness = np.empty(len(depths), dtype=np.int64)
        contour_kernels.inward(shade, *crossing, expected, thickness, weights)
        places = np.empty((len(depths), 2))
        edge_kernels.places(
            lines, weights, expected, thickness, shading.sigma, self._alike, SEARCH, places
        )
        places[thickness < THICK] = 0.0, np.inf
        return places

    def normal_equations(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Information (6, 6), gradient (6,) and weighted sum of [p_o; 1] [p_o; 1]^T (4, 4), as ``Evidence`` has them.

        A line whose variance is that of not knowing, SEARCH^2 / 3, has no weight. What all are off alike, as where
        light bleeds over edges, is eliminated (Schur complement): it would look like another distance.
        """
        means, variances = self.places.T
        weights = np.maximum(1.0 / (variances + FLOOR**2) - 3.0 / SEARCH**2, 0.0)
        together = 2 * BESIDE + self._alike  # lines: they are a pixel apart, and each is a mean
        weights /= together * (1.0 + (means / CUTOFF) ** 2) ** 2
        rows = np.column_stack([self.jacobian(), np.ones(len(means))])
        information, gradient = (rows.T * weights) @ rows, -rows.T @ (weights * means)
        common = information[:6, 6] / (information[6, 6] + 1.0 / COMMON**2)
        points = np.column_stack([self.points_o, np.ones(len(means))])
        moments = (points.T * (weights * (rows[:, 3:6] ** 2).sum(axis=1))) @ points
        return (
            information[:6, :6] - np.outer(common, information[:6, 6]),
            gradient[:6] - common * gradient[6],
            moments,
        )

    def jacobian(self) -> np.ndarray:
        """How far the outline moves along each line [pixels] for a right perturbation of the pose, shape (N, 6)."""
        x, y, z = ((self.points_o - self._t_oc) @ self._R_oc).T
        along = self.normals * self._focal
        a_c = np.column_stack([along, -(along[:, 0] * x + along[:, 1] * y) / z]) / z[:, None]
        a_o = a_c @ self._R_oc.T
        return np.hstack([np.cross(self.points_o, a_o), a_o])


def learn_shading(view: View, seen: Evidence) -> None:
    """Let the view's shading learn from the pixels that show the object, a little inside its outline.

    Args:
        view: A view with an infrared image.
        seen: What it says of the pose that was found in it.
    """
    assert view.infrared is not None
    free = max(1, round(FREE / view.infrared.step))
    inside = ndimage.minimum_filter(seen.predicted < np.inf, size=2 * free + 1)
    front = ndimage.minimum_filter(view.hand_depth, size=2 * free + 1)
    brightness = view.infrared.seen
    shows = inside & (front >= seen.predicted + contour_kernels.IN_FRONT) & ~np.isnan(brightness)
    shows &= seen.kind != kernels.COVERED
    view.infrared.shading.learn(np.where(shows, brightness, np.nan), seen.normals_c)
