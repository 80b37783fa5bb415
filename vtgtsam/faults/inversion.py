# SPDX-License-Identifier: MIT
"""Do contact bits say the opposite? Seen when all of them turn over at once, or by where the object is."""

from __future__ import annotations

import numpy as np

from .lasting import Lasting

FAR = 0.008  # [m], a pad in contact is never so far from the object
NEAR = 0.003  # [m], a pad so near should touch
MANY = 3  # pads that are far although they touch, more than half of all: no accident
FEWEST = 6  # pads; of fewer, all may change at once by chance
TURNED_OVER = (
    0.85  # share of all bits; no hand opens some pads and closes all others within a frame
)
LASTS = 0.25  # [s]
FITS_AGAIN = 0.5  # [s]


class InversionWatch:
    """Watches whether the pads' bits are inverted.

    Attributes:
        inverted: Whether they are, as far as is known.
    """

    def __init__(self) -> None:
        self.inverted = False
        self._bits: np.ndarray | None = None
        self._against = Lasting(LASTS)
        self._fits = Lasting(FITS_AGAIN)

    def before(self, touching: np.ndarray) -> bool:
        """Whether a frame's bits, shape (K,), are inverted, as far as is known before it is solved."""
        last, self._bits = self._bits, touching
        if last is not None and _turned_over(last, touching):
            self.inverted = not self.inverted
            self._fits.holds(0.0, False)
        return self.inverted

    def after(self, time: float, touching: np.ndarray, distances: np.ndarray, known: bool) -> bool:
        """The same in view of all pads' distances from the object [m], shape (K,), where the pose is known."""
        far = touching & (distances > FAR) if known else np.zeros_like(touching)
        near = ~touching & (distances < NEAR) if known else np.zeros_like(touching)
        many = np.count_nonzero(far)
        against = many >= MANY and 2 * many > np.count_nonzero(touching)
        if self._against.holds(time, bool(against and np.count_nonzero(near) > 1)):
            self.inverted = True
        if self._fits.holds(time, bool(known and touching.any() and not far.any())):
            self.inverted = False
        return self.inverted


def _turned_over(last: np.ndarray, now: np.ndarray) -> bool:
    """Whether nearly all bits (K,) have changed, some from contact to none and some the other way."""
    changed = last != now
    enough = len(now) >= FEWEST and np.count_nonzero(changed) >= TURNED_OVER * len(now)
    return bool(enough and (changed & now).any() and (changed & last).any())
