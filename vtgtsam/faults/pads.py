# SPDX-License-Identifier: MIT
"""Do the pads agree? One that contradicts the rest, one that flickers, or none that fits."""

from __future__ import annotations

from collections import deque

import numpy as np

from .inversion import FAR
from .lasting import Lasting
from .words import NO_FIT, pad_disagrees, pad_flickers

MISFIT = 0.004  # [m], gap or depth of most pads in contact that no joint zero explains
DISAGREES = 0.25  # [s]
FLICKERS = 15  # frames, in nearly all of which a bit changes


class PadWatch:
    """Watches contact bits against the object at the estimate.

    Args:
        names: The pads' names.
    """

    def __init__(self, names: tuple[str, ...]) -> None:
        self._names = names
        self._far = [Lasting(DISAGREES) for _ in names]
        self._misfit = Lasting(2 * DISAGREES)
        self._bits: deque[np.ndarray] = deque(maxlen=FLICKERS + 1)

    def after(
        self, time: float, touching: np.ndarray, distances: np.ndarray, believed: bool
    ) -> tuple[str, ...]:
        """What is wrong, in the fixed words.

        Args:
            time: The frame's instant [s].
            touching: Which pads report contact, shape (K,).
            distances: All pads' distances at the estimate [m], shape (K,).
            believed: Whether the pose is known well enough to judge pads by it.
        """
        self._bits.append(touching)
        faults = [pad_flickers(self._names[k]) for k in self._flickering()]
        known = believed and bool(np.isfinite(distances).all())
        far = touching & (distances > FAR) if known else np.zeros_like(touching)
        count = np.count_nonzero(touching)
        held = [watch.holds(time, bool(far[k])) for k, watch in enumerate(self._far)]
        faults += [pad_disagrees(self._names[k]) for k in np.flatnonzero(held)]
        gaps = np.abs(distances[touching])
        misfit = bool(known and count > 2 and np.median(gaps) > MISFIT)
        if self._misfit.holds(time, misfit):
            faults.append(NO_FIT)
        return tuple(faults)

    def _flickering(self) -> np.ndarray:
        """Indices of the pads whose bits change nearly always."""
        if len(self._bits) <= FLICKERS:
            return np.zeros(0, dtype=np.int64)
        changes = np.diff(np.array(self._bits, dtype=np.int8), axis=0) != 0
        return np.flatnonzero(changes.sum(axis=0) >= FLICKERS - 1)
