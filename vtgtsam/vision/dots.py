# SPDX-License-Identifier: MIT
"""Which pixels of an infrared image show the dots that a depth camera projects, and nothing of the scene."""

from __future__ import annotations

import numpy as np

_SIZE = 5  # [pixels], a dot is smaller
BRIGHT = 4.0  # [sigma of the image's noise], what is so much brighter than all around it is a dot
LEAST = 1.0  # [gray levels], of that sigma: the image is rounded
TO_SIGMA = 1.4826  # from a median of absolute values to a standard deviation


def without_dots(image: np.ndarray) -> np.ndarray:
    """The brightness [gray levels], shape (height, width), NaN where there is a dot or light from one.

    A morphological opening (the darkest pixel around, then the brightest of those) takes away what is bright and
    smaller than a disc of 5 pixels, and leaves straight edges where they are. What it takes away is left out, not
    filled: it would take away bright tips of the object, too, and move their outline.

    Args:
        image: An infrared image of uint8, shape (height, width).
    """
    from scipy import ndimage

    brightness = image.astype(np.float64)
    excess = brightness - ndimage.grey_opening(image, footprint=_disc()).astype(np.float64)
    middle = float(np.median(excess))
    sigma = max(TO_SIGMA * float(np.median(np.abs(excess - middle))), LEAST)
    dots = ndimage.binary_dilation(excess > middle + BRIGHT * sigma)
    return np.where(dots, np.nan, brightness)


def _disc() -> np.ndarray:
    """A square of ``_SIZE`` without its corners."""
    disc = np.ones((_SIZE, _SIZE), dtype=bool)
    disc[:: _SIZE - 1, :: _SIZE - 1] = False
    return disc
