# SPDX-License-Identifier: MIT
"""Which pads hang on which input of the board, and what resistance a reading means.

Each input is a voltage divider: supply, reference resistor, input, pad, ground. Pads wired in
parallel share an input and always carry the same contact bit. A hand's YAML file says it so, one
entry an input, in the order of the board:

    pads:
      inputs:
        - {pads: [pad_index_distal], reference_ohm: 10000}
        - {pads: [pad_palm_left_a, pad_palm_left_b], reference_ohm: 4700}
      disabled: [pad_thumb_tip]
      threshold: 0.15      # of a press with 6 N
      release: 0.08        # hysteresis; where not given, the threshold itself
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vtgtsam.exceptions import ConfigError

from .frame import FULL_SCALE

THRESHOLD = 0.15  # fraction of a press with 6 N
_USABLE = 0.01, 0.99  # of the supply voltage: below is a short circuit, above an open one


@dataclass(frozen=True, eq=False)
class PadWiring:
    """The pads of a hand as the board sees them.

    Attributes:
        inputs: Names of the pads on each input.
        reference_ohm: Reference resistor of each input [ohm], shape (N,).
        disabled: Pads whose contact bit is to stay off.
        threshold: Contact begins above it; fraction of a press with 6 N.
        release: Contact ends below it; the same fraction or a lower one.
    """

    inputs: tuple[tuple[str, ...], ...]
    reference_ohm: np.ndarray
    disabled: frozenset[str] = frozenset()
    threshold: float = THRESHOLD
    release: float = THRESHOLD

    def __post_init__(self) -> None:
        names = self.pad_names
        doubles = sorted({name for name in names if names.count(name) > 1})
        if doubles:
            raise ConfigError(f"pads: on more than one input: {', '.join(doubles)}")
        unknown = sorted(self.disabled - set(names))
        if unknown:
            raise ConfigError(f"pads: disabled but on no input: {', '.join(unknown)}")
        if not 0 < self.release <= self.threshold < 1:
            raise ConfigError(
                "pads: needs 0 < release <= threshold < 1, got "
                f"release {self.release:g} and threshold {self.threshold:g}"
            )

    @property
    def pad_names(self) -> tuple[str, ...]:
        """All pads, in the order of the inputs."""
        return tuple(name for pads in self.inputs for name in pads)

    @property
    def enabled(self) -> np.ndarray:
        """Which inputs have a pad that is not disabled, shape (N,)."""
        return np.array([not self.disabled.issuperset(pads) for pads in self.inputs])

    def input_of(self, pad_names: Iterable[str]) -> np.ndarray:
        """The input that each of these pads is on, shape (K,).

        Raises:
            ConfigError: A pad is on no input, or an input has a pad that is not among these.
        """
        pad_names = tuple(pad_names)
        index = {name: i for i, pads in enumerate(self.inputs) for name in pads}
        missing = [name for name in pad_names if name not in index]
        strange = sorted(set(index) - set(pad_names))
        if missing or strange:
            raise ConfigError(
                "pads: the inputs must list the hand's pads; missing: "
                f"{', '.join(missing) or 'none'}; not of this hand: {', '.join(strange) or 'none'}"
            )
        return np.array([index[name] for name in pad_names])

    def label(self, index: int) -> str:
        """The input's pads, for people to read."""
        return " and ".join(self.inputs[index])

    def resistance(self, values: np.ndarray) -> np.ndarray:
        """Resistances of the inputs [ohm], shape (..., N); NaN where shorted or open.

        Args:
            values: Readings of the board, shape (..., N).
        """
        fraction = np.asarray(values, dtype=np.float64) / FULL_SCALE
        low, high = _USABLE
        fraction = np.where((fraction >= low) & (fraction <= high), fraction, np.nan)
        return self.reference_ohm * fraction / (1.0 - fraction)


def wiring_from_mapping(section: Mapping[str, Any]) -> PadWiring:
    """The wiring that the section ``pads`` of a hand's YAML file describes.

    Raises:
        ConfigError: Something in it is missing, unknown or of the wrong kind.
    """
    _check_keys(section, "pads", {"inputs"}, {"disabled", "threshold", "release"})
    inputs = section["inputs"]
    if not isinstance(inputs, list) or not inputs:
        raise ConfigError(f"pads: inputs must be a list with one entry an input, got {inputs!r}")
    for entry in inputs:
        _check_keys(entry, "pads: inputs", {"pads", "reference_ohm"}, set())
    threshold = _number(section.get("threshold", THRESHOLD), "threshold")
    return PadWiring(
        inputs=tuple(_names(entry["pads"], "pads of an input") for entry in inputs),
        reference_ohm=np.array([_ohm(entry["reference_ohm"]) for entry in inputs]),
        disabled=frozenset(_names(section.get("disabled", []), "disabled", empty=True)),
        threshold=threshold,
        release=_number(section.get("release", threshold), "release"),
    )


def _check_keys(section: object, where: str, needed: set[str], optional: set[str]) -> None:
    if not isinstance(section, Mapping):
        raise ConfigError(f"{where}: must be a mapping with {', '.join(sorted(needed))}")
    missing, unknown = needed - set(section), set(section) - needed - optional
    if missing or unknown:
        raise ConfigError(
            f"{where}: missing keys: {', '.join(sorted(missing)) or 'none'}; unknown keys: "
            f"{', '.join(sorted(map(str, unknown))) or 'none'}"
        )


def _names(value: object, where: str, empty: bool = False) -> tuple[str, ...]:
    is_list = isinstance(value, Sequence) and not isinstance(value, str)
    if not is_list or not (value or empty) or not all(isinstance(name, str) for name in value):
        raise ConfigError(f"pads: {where} must be a list of pad names, got {value!r}")
    return tuple(value)


def _number(value: object, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ConfigError(f"pads: {where} must be a number, got {value!r}")
    return float(value)


def _ohm(value: object) -> float:
    ohm = _number(value, "reference_ohm")
    if not (0 < ohm < np.inf):
        raise ConfigError(f"pads: reference_ohm must be positive, got {ohm:g}")
    return ohm
