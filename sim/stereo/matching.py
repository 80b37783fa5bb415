# SPDX-License-Identifier: MIT
"""Disparity of two infrared images: OpenCV's semi-global matching, then refined below a pixel.

The matcher alone locks to its own steps of a sixteenth of a pixel and to whole pixels (5 mm at 0.8 m). Two steps of
Lucas and Kanade over a window give the disparity d at which the left image L is the right one R moved:

    d <- d + sum g (R(x - d) - L(x)) / sum g^2,    g = dR/dx at x - d

Each pixel of a window is moved by its own disparity, so what differs from pixel to pixel is smoothed after each step,
but not over the edge of a surface (0.2 pixels become 0.1; without it further steps make it worse again).
"""

from __future__ import annotations

import cv2
import numpy as np

from . import rig

BLOCK = 7  # [pixels]
UNIQUENESS = 10  # [%]
CONSISTENCY = 1  # [pixels], left to right and back
SPECKLE = (50, 2)  # [pixels, disparities], smaller islands are dropped
PREFILTER = 63
WINDOW = 15  # [pixels], of the refinement
REFINEMENTS = 2
SMOOTHING = (7, 0.7, 2.0)  # bilateral filter: size [pixels], sigma [disparities] and sigma [pixels]
MAX_REFINEMENT = 1.0  # [pixels], a larger correction is none
LEAST_TEXTURE = 1.0  # [gray levels^2 / pixel^2], less in a window refines nothing


class Matcher:
    """Matches images of one size."""

    def __init__(self) -> None:
        cv2.setNumThreads(1)  # the processes are the parallel ones
        self._sgbm = cv2.StereoSGBM.create(
            minDisparity=0,
            numDisparities=rig.DISPARITIES,
            blockSize=BLOCK,
            P1=8 * BLOCK**2,
            P2=32 * BLOCK**2,
            disp12MaxDiff=CONSISTENCY,
            preFilterCap=PREFILTER,
            uniquenessRatio=UNIQUENESS,
            speckleWindowSize=SPECKLE[0],
            speckleRange=SPECKLE[1],
        )

    def disparity(self, left: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Disparity [pixels], 0 where there is none, of two images of uint8; shape (height, width)."""
        coarse = self._sgbm.compute(left, right).astype(np.float32) / 16.0
        found = coarse > 0.0
        refined = coarse
        for _ in range(REFINEMENTS):
            refined = cv2.bilateralFilter(refined + _step(left, right, refined), *SMOOTHING)
        usable = found & (abs(refined - coarse) <= MAX_REFINEMENT)
        disparity = np.where(usable, refined, coarse)
        rounded = np.round(disparity / rig.DISPARITY_STEP) * rig.DISPARITY_STEP
        return np.where(found, np.maximum(rounded, 0.0), 0.0)


def _step(left: np.ndarray, right: np.ndarray, disparity: np.ndarray) -> np.ndarray:
    """One step of Lucas and Kanade along the rows [pixels]."""
    height, width = left.shape
    u, v = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    right = right.astype(np.float32)
    slope: np.ndarray = cv2.Sobel(right, cv2.CV_32F, 1, 0, ksize=1) / 2.0
    at = (u - disparity).astype(np.float32)
    moved = cv2.remap(right, at, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    g = cv2.remap(slope, at, v, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    window = (WINDOW, WINDOW)
    above = cv2.boxFilter(g * (moved - left), cv2.CV_32F, window)
    below = cv2.boxFilter(g * g, cv2.CV_32F, window)
    step: np.ndarray = np.where(
        below > LEAST_TEXTURE, above / np.maximum(below, LEAST_TEXTURE), 0.0
    )
    return step


def depth_of(disparity: np.ndarray, fx: float, max_range: float) -> np.ndarray:
    """Depth [m] of disparities [pixels]; 0 where there is none or it is beyond ``max_range``."""
    with np.errstate(divide="ignore"):
        depth = fx * rig.BASELINE / disparity
    return np.where(depth <= max_range, depth, 0.0)
