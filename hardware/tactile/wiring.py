# SPDX-License-Identifier: MIT
"""Which pads hang on which input of the board, and what resistance a reading means.

Each input is a voltage divider: supply, reference resistor, input, pad, ground. Pads wired in
parallel share an input and always carry the same contact bit. A hand's YAML file says it so, one
entry an input, in the order of the board:

    pads:
      inputs:
        - {pads: [pad_index_distal], reference_ohm: 10000}
        - {pads: [pad_palm_inner_1, pad_palm_inner_2], reference_ohm: 4700}
      disabled: [pad_thumb_distal]
      threshold: 0.15      # of a press with 6 N
      release: 0.08        # hysteresis; where not given, the threshold itself, as in the paper
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from vtgtsam.exceptions import ConfigError

from .frame import FULL_SCALE

_USABLE = 0.01, 0.99  # of the supply voltage: below is a short circuit, above an open one

_Fraction = Annotated[float, Field(gt=0, lt=1)]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class PadInput(_Model):
    """One input of the board.

    Attributes:
        pads: The pads on it, more than one where they are wired in parallel.
        reference_ohm: Its reference resistor [ohm], best about the pads' resistance untouched.
    """

    pads: tuple[str, ...] = Field(min_length=1)
    reference_ohm: float = Field(gt=0, allow_inf_nan=False)


class PadWiring(_Model):
    """The pads of a hand as the board sees them.

    Attributes:
        inputs: The board's inputs, in its order.
        disabled: Pads whose contact bit is to stay off.
        threshold: Contact begins above it; fraction of a press with 6 N.
        release: Contact ends below it; None where that is the threshold.
    """

    inputs: tuple[PadInput, ...] = Field(min_length=1)
    disabled: frozenset[str] = frozenset()
    threshold: _Fraction = 0.15
    release: _Fraction | None = None

    @model_validator(mode="after")
    def _check(self) -> PadWiring:
        names = self.pad_names
        doubles = sorted({name for name in names if names.count(name) > 1})
        if doubles:
            raise ValueError(f"each pad is on one input; on more: {', '.join(doubles)}")
        unknown = sorted(self.disabled.difference(names))
        if unknown:
            raise ValueError(f"disabled, but on no input: {', '.join(unknown)}")
        if self.release is not None and self.release > self.threshold:
            raise ValueError(
                f"release must not exceed the threshold {self.threshold:g}, is {self.release:g}"
            )
        return self

    @property
    def pad_names(self) -> tuple[str, ...]:
        """All pads, in the order of the inputs."""
        return tuple(name for entry in self.inputs for name in entry.pads)

    @property
    def enabled(self) -> np.ndarray:
        """Which inputs have a pad that is not disabled, shape (N,)."""
        return np.array([not self.disabled.issuperset(entry.pads) for entry in self.inputs])

    def input_of(self, pad_names: Iterable[str]) -> np.ndarray:
        """The input that each of the hand's pads is on, shape (K,).

        Args:
            pad_names: The hand's pads.

        Raises:
            ConfigError: A pad is on no input, or an input has a pad that is not among these.
        """
        pad_names = tuple(pad_names)
        index = {name: i for i, entry in enumerate(self.inputs) for name in entry.pads}
        missing = [name for name in pad_names if name not in index]
        strange = sorted(set(index).difference(pad_names))
        if missing or strange:
            raise ConfigError(
                "the inputs under 'pads' in the hand's file must list the hand's pads; missing: "
                f"{', '.join(missing) or 'none'}; not of this hand: {', '.join(strange) or 'none'}"
            )
        return np.array([index[name] for name in pad_names])

    def label(self, index: int) -> str:
        """The input's pads, for people to read."""
        return " and ".join(self.inputs[index].pads)

    def resistance(self, values: np.ndarray) -> np.ndarray:
        """Resistances of the inputs [ohm], shape (..., N); NaN where shorted or open.

        Args:
            values: Readings of the board, shape (..., N).
        """
        fraction = np.asarray(values, dtype=np.float64) / FULL_SCALE
        low, high = _USABLE
        fraction = np.where((fraction >= low) & (fraction <= high), fraction, np.nan)
        return self.reference_ohm * fraction / (1.0 - fraction)

    @property
    def reference_ohm(self) -> np.ndarray:
        """The reference resistors [ohm], shape (N,)."""
        return np.array([entry.reference_ohm for entry in self.inputs])
