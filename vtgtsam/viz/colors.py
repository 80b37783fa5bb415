# SPDX-License-Identifier: MIT
"""Colours of the viewer as RGB: methods as everywhere (``evaluation.palette``), the truth grey, pads by belief."""

from __future__ import annotations

import numpy as np

from ..evaluation.palette import OF_METHODS, OTHERS, TRUTH, rgb
from . import names

RGB = tuple[int, int, int]

NAMED: dict[str, RGB] = {
    **{method: rgb(color) for method, color in OF_METHODS.items()},
    names.TRUTH: rgb(TRUTH),
    names.TRACKER: rgb(OF_METHODS["vis"]),
    names.LIVE: rgb(OF_METHODS["vis+tac+pen+mem"]),  # what a plain estimator does
}
_OTHERS: tuple[RGB, ...] = (*map(rgb, OTHERS[:2]), (240, 228, 66))  # black is not seen there

FREE = np.array([150, 155, 165])  # a pad without contact
DOUBTED = np.array([0, 114, 178])  # in contact, but the estimate does not count on it
BELIEVED = np.array([255, 210, 30])  # in contact, and it counts in full


class Palette:
    """Colours by name: known names have their own, others get the next free one."""

    def __init__(self) -> None:
        self._others: list[str] = []

    def of(self, name: str) -> RGB:
        """The colour of a method."""
        if name in NAMED:
            return NAMED[name]
        if name not in self._others:
            self._others.append(name)
        return _OTHERS[self._others.index(name) % len(_OTHERS)]


def of_pads(contacts: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Colours of pads, uint8, shape (K, 3): gray without contact, else from blue to yellow by weight.

    Args:
        contacts: Contact bits, shape (K,).
        weights: How much each contact counts, in [0, 1], shape (K,).
    """
    share = np.clip(weights, 0, 1)[:, None]
    touched = (1 - share) * DOUBTED + share * BELIEVED
    colors = np.where(np.asarray(contacts, dtype=bool)[:, None], touched, FREE)
    return np.rint(colors).astype(np.uint8)
