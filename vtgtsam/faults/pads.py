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
        self._far_since = np.full(len(names), np.nan)  # [s]
        self._misfit = Lasting(2 * DISAGREES)
        self._bits: np.ndarray | None = None
        self._changes: deque[np.ndarray] = deque()
        self._changed = np.zeros(
            len(names), dtype=np.int64
        )  # how often, in the last ``FLICKERS`` frames

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
        faults = [pad_flickers(self._names[k]) for k in self._flickering(touching)]
        known = believed and bool(np.isfinite(distances).all())
        far = touching & (distances > FAR) if known else np.zeros_like(touching)
        faults += [pad_disagrees(self._names[k]) for k in self._far_for_long(time, far)]
        if self._misfit.holds(time, known and _misfit(distances[touching])):
            faults.append(NO_FIT)
        return tuple(faults)

    def _far_for_long(self, time: float, far: np.ndarray) -> np.ndarray:
        """Indices of the pads that have been far from the object without a break."""
        if not far.any():
            self._far_since.fill(np.nan)
            return np.zeros(0, dtype=np.int64)
        began = np.where(np.isnan(self._far_since), time, self._far_since)
        self._far_since = np.where(far, began, np.nan)
        return np.flatnonzero(time - self._far_since >= DISAGREES)

    def _flickering(self, touching: np.ndarray) -> np.ndarray:
        """Indices of the pads whose bits change nearly always."""
        if self._bits is not None:
            changes = self._bits != touching
            self._changes.append(changes)
            self._changed += changes
            if len(self._changes) > FLICKERS:
                self._changed -= self._changes.popleft()
        self._bits = touching
        if len(self._changes) < FLICKERS:
            return np.zeros(0, dtype=np.int64)
        return np.flatnonzero(self._changed >= FLICKERS - 1)


def _misfit(gaps: np.ndarray) -> bool:
    """Whether most of the touching pads' distances (N,) [m] are too large."""
    sizes = np.abs(gaps)
    return bool(len(sizes) > 2 and sizes.max() > MISFIT and np.median(sizes) > MISFIT)
