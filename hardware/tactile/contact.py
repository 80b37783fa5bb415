# SPDX-License-Identifier: MIT
"""Contact bits from the pads' pressures: the paper's threshold, with hysteresis as an option.

A pad begins to be in contact above the threshold and ceases below the release level; where both are
the same this is the paper's plain threshold.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from .calibrate import PadScale, pressure
from .wiring import PadWiring


@dataclass(frozen=True, eq=False)
class PadState:
    """All pads at one instant, in the order of the hand's pads.

    Attributes:
        pressure: Fraction of a press with 6 N, shape (K,); NaN where a pad is disabled or its input
            open or shorted.
        contacts: Contact bits, shape (K,); off where the pressure is NaN.
    """

    pressure: np.ndarray
    contacts: np.ndarray


class ContactDetector:
    """Turns the board's readings into contact bits; remembers which pads are in contact."""

    def __init__(
        self, wiring: PadWiring, scale: PadScale, baseline: np.ndarray, pad_names: Iterable[str]
    ) -> None:
        """Begin with no contact.

        Args:
            wiring: The pads as the board sees them.
            scale: Their bench calibration.
            baseline: Resistances of the inputs measured before this run [ohm], shape (N,).
            pad_names: The hand's pads, in the order in which the bits are wanted.
        """
        pad_names = tuple(pad_names)
        self._wiring = wiring
        self._drop = scale.drop
        self._baseline = baseline
        self._input_of = wiring.input_of(pad_names)
        self._off = np.array([name in wiring.disabled for name in pad_names])
        self._release = wiring.threshold if wiring.release is None else wiring.release
        self._touched = np.zeros(len(wiring.inputs), dtype=bool)

    def update(self, values: np.ndarray) -> PadState:
        """The pads' state after one more set of readings.

        Args:
            values: The board's readings, shape (N,).
        """
        inputs = pressure(self._wiring.resistance(values), self._baseline, self._drop)
        level = np.where(self._touched, self._release, self._wiring.threshold)
        self._touched = inputs > level  # NaN compares false: a dead input is never in contact
        pads = np.where(self._off, np.nan, inputs[self._input_of])
        return PadState(pressure=pads, contacts=self._touched[self._input_of] & ~self._off)
