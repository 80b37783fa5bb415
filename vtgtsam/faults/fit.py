# SPDX-License-Identifier: MIT
"""Does the object fit into the hand that holds it where vision sees it?

A tracker that is off puts the surface into the pads of one side and away from those of the other. An object that is
too large has its surface beyond the pads of opposite sides, one that is too small misses all of them: no place is
right.
"""

from __future__ import annotations

import numpy as np

from ..frame import Frame
from ..hands.pads import PadSet
from ..sdf.grid import GridSdf
from .lasting import Lasting

OFF = 0.004  # [m], more than joint zeros and a mesh's own error
MOST = 0.75  # of the touching pads are off to the same side of the surface ...
CLEARLY = 0.002  # [m], ... by so much
OPPOSITE = -0.5  # cosine between the surface's normals at two pads of opposite sides
LASTS = 0.25  # [s]
FITS_AGAIN = 1.0  # [s]
DOUBTED = 0.5  # visual weight, or ...
DEEP = -0.002  # [m], ... a pad's distance, below which it is worth a look


class FitWatch:
    """Watches frames in which vision and touch do not agree.

    Args:
        hand: The hand.
        sdf: The object's distance field.

    Attributes:
        misfit: Whether the object fits nowhere, as far as is known.
    """

    def __init__(self, hand: PadSet, sdf: GridSdf) -> None:
        self._pads = hand.pads
        self._sdf = sdf
        self._nowhere = Lasting(LASTS)
        self._fits = Lasting(FITS_AGAIN)
        self.misfit = False

    def after(self, frame: Frame, visual_weight: float, distances: np.ndarray) -> bool:
        """Whether the object fits nowhere about a frame's visual pose, and has not for some time.

        Args:
            frame: The frame, with its pads; without a visual pose it says nothing.
            visual_weight: How much the visual pose counts; 1 where vision itself is suspect.
            distances: The pads' distances at the estimate [m], shape (K,).
        """
        if frame.T_ho_visual is None or not frame.pads_known:
            return self.misfit
        nowhere = False
        doubted = visual_weight < DOUBTED or bool((distances < DEEP).any())
        if (doubted or self.misfit) and np.count_nonzero(frame.touching) > 1:
            points_o = self._closest(frame, frame.T_ho_visual.inverse().matrix())
            nowhere = fits_nowhere(*self._sdf.value_and_gradient(points_o))
        if self._nowhere.holds(frame.time, nowhere):
            self.misfit = True
        if self._fits.holds(frame.time, not nowhere):
            self.misfit = False
        return self.misfit

    def _closest(self, frame: Frame, T_oh: np.ndarray) -> np.ndarray:
        """Of each touching pad the point of least distance, in the object's frame [m], shape (N, 3)."""
        closest = []
        for k in np.flatnonzero(frame.touching):
            T_op = T_oh @ frame.T_hp[k]
            points_o = self._pads[k].points_p @ T_op[:3, :3].T + T_op[:3, 3]
            closest.append(points_o[np.argmin(self._sdf.value(points_o))])
        return np.array(closest)


def fits_nowhere(distances: np.ndarray, gradients: np.ndarray) -> bool:
    """Whether touching points lie inside the object, or away from it, on opposite sides.

    Args:
        distances: Signed distances [m], shape (N,).
        gradients: Their gradients, shape (N, 3).
    """
    normals = gradients / np.maximum(np.linalg.norm(gradients, axis=1), 1e-9)[:, None]
    for depths in (-distances, distances):
        off = depths > CLEARLY
        opposite = (normals[off] @ normals[off].T).min(initial=1.0) < OPPOSITE
        if opposite and np.mean(off) >= MOST and np.median(depths) > OFF:
            return True
    return False
