# SPDX-License-Identifier: MIT
"""Which image each numbered pose is of.

Numbers in names of files or in a csv mean different things to different people: the image itself counted
from 0 or from 1, the n-th image that the program looked at (every second one, say), or images counted
from where it began. All of these are

    image = first + every (number - smallest number)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...exceptions import RecordingError

LARGEST_STRIDE = 10  # images per number that are tried


@dataclass(frozen=True)
class Numbering:
    """What numbers mean.

    Attributes:
        first: The image of the smallest number, counted from 0.
        every: How many images each next number is further on.
        in_order: Instead of all that, each pose is of the next image, whatever it is called.
    """

    first: int = 0
    every: int = 1
    in_order: bool = False

    def images(self, numbers: np.ndarray) -> np.ndarray:
        """Image of each number, counted from 0, int64, shape (N,)."""
        if self.in_order:
            return np.arange(len(numbers))
        images: np.ndarray = self.first + self.every * (numbers - numbers.min())
        return images

    def options(self) -> str:
        """What to type for it."""
        return f"--first {self.first}" + (f" --every {self.every}" if self.every > 1 else "")

    def __str__(self) -> str:
        return (
            f"every {_ordinal(self.every)} image from image {self.first}"
            if self.every > 1
            else f"images from image {self.first} on"
        )


def usual_numbering(numbers: np.ndarray, count: int, path: object) -> Numbering:
    """What the numbers say of themselves where ``count`` images were taken.

    Raises:
        RecordingError: There are fewer images than numbers want.
    """
    low, high = int(numbers.min()), int(numbers.max())
    if len(numbers) == count:
        return Numbering(in_order=True)
    if high < count:
        return Numbering(low)
    if high == count and low >= 1:
        return Numbering(low - 1)
    raise RecordingError(
        f"{path} has {len(numbers)} poses of images {low} to {high}, but there are {count} images; "
        "give the poses of this recording, or a TUM file, whose lines have stamps"
    )


def possible_numberings(numbers: np.ndarray, count: int) -> Iterator[Numbering]:
    """All meanings with which every number has an image."""
    span = int(numbers.max() - numbers.min())
    for every in range(1, LARGEST_STRIDE + 1 if span else 2):
        for first in range(count - every * span):
            yield Numbering(first, every)


def _ordinal(number: int) -> str:
    return {2: "2nd", 3: "3rd"}.get(number, f"{number}th")
