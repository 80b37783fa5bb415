# SPDX-License-Identifier: MIT
"""The part of an infrared image that belongs to a view of the depth image, pixel by pixel.

The depth of a stereo camera is that of its left infrared imager, and the two images show the same; but matching
fattens what is near by some pixels, and the infrared image does not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..camera import CameraIntrinsics
from .dots import without_dots
from .shading import Shading


@dataclass(frozen=True, eq=False)
class Infrared:
    """An infrared image and what is known of the object in it.

    Attributes:
        brightness: The image [gray levels], NaN where there are dots; it has all pixels, whatever the view's step.
        shading: How bright the object is.
        step: The view has every ``step``-th of its rows and columns.
    """

    brightness: np.ndarray
    shading: Shading
    step: int = 1

    def strided(self, step: int) -> Infrared:
        """The same for every ``step``-th row and column of the view."""
        return replace(self, step=self.step * step)

    @property
    def seen(self) -> np.ndarray:
        """The brightness in the view's own pixels."""
        return self.brightness[:: self.step, :: self.step]


def infrared_part(
    image: np.ndarray, whole: CameraIntrinsics, part: CameraIntrinsics, shading: Shading
) -> Infrared:
    """The part of an infrared image that a view shows.

    Args:
        image: The whole image, of uint8.
        whole: Intrinsics of the depth image, and of this one.
        part: Intrinsics of the view.
        shading: What is known of the object's brightness.

    Raises:
        ValueError: The image has another size than the depth image, or is of another type.
    """
    if image.shape != (whole.height, whole.width) or image.dtype != np.uint8:
        raise ValueError(
            f"the infrared image must be of uint8 and have the depth image's shape "
            f"{(whole.height, whole.width)}, got {image.dtype} of shape {image.shape}"
        )
    left, top = round(whole.cx - part.cx), round(whole.cy - part.cy)
    return Infrared(without_dots(image[top : top + part.height, left : left + part.width]), shading)
