# SPDX-License-Identifier: MIT
r"""Calibration of the pads as in the paper (section on the tactile sensor hardware).

A press lowers a pad's resistance R, shear and the moment after a release raise it. So only drops
below the baseline count, in units of the drop under a force of 6 N:

    u = max(R_base - R, 0) / (R_base - R_6N)

The baseline R_base wanders between runs and is measured before each: the median of 2 s with nothing
touching the hand. The scale R_base - R_6N belongs to the pad and is measured once a hand.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from hardware.device import PadDevice, PadState
from vtgtsam.atomic import write_text
from vtgtsam.exceptions import ConfigError, VtgtsamError
from vtgtsam.input.text import read_yaml

from .board import PadBoard
from .wiring import PadWiring

log = logging.getLogger(__name__)

BASELINE_SECONDS = 2.0
STEADY = 0.02  # of the baseline: more scatter or a greater shift within the 2 s is a touch
LEAST_DROP = 0.05  # of the baseline: a pad that 6 N change by less drowns in noise at the threshold
PRESSED = 0.5  # of a 6 N press below the bench's baseline: more than pads wander by themselves

_ADVICE = "run `python -m hardware calibrate-pads`"


class PadCalibrationError(VtgtsamError):
    """A pad is touched, moving or dead, or a press could not be used."""


def pressure(resistance: np.ndarray, baseline: np.ndarray, drop: np.ndarray) -> np.ndarray:
    """Pressure as fraction of a press with 6 N, shape (..., N); NaN where the input is dead.

    Args:
        resistance: Resistances of the inputs [ohm], shape (..., N).
        baseline: Resistances untouched [ohm], shape (N,).
        drop: Fall of resistance under 6 N [ohm], shape (N,).
    """
    return np.asarray(np.maximum(baseline - resistance, 0.0) / drop)


@dataclass(frozen=True, eq=False)
class PadScale:
    """What was measured on the bench, once a hand.

    Attributes:
        baseline: Resistance of each input when nothing touched it [ohm], shape (N,).
        drop: Fall of resistance under 6 N [ohm], shape (N,); NaN where the input was left out.
    """

    baseline: np.ndarray
    drop: np.ndarray


def measure_baseline(
    resistances: np.ndarray, wiring: PadWiring, scale: PadScale | None = None
) -> np.ndarray:
    """The inputs' untouched resistances before a run [ohm], shape (N,).

    Inputs whose pads are all disabled are not judged.

    Args:
        resistances: Two seconds of resistances [ohm], shape (T, N).
        wiring: The pads of the hand.
        scale: The bench calibration, which shows pads that are held down all the while.

    Raises:
        PadCalibrationError: Some pads cannot be used, with the reason for each.
    """
    resistances = np.asarray(resistances, dtype=np.float64)
    if resistances.ndim != 2 or resistances.shape[1] != len(wiring.inputs) or len(resistances) < 10:
        raise ValueError(
            f"resistances must have shape (T, {len(wiring.inputs)}) with T >= 10, "
            f"got {resistances.shape}"
        )
    baseline: np.ndarray = np.median(resistances, axis=0)  # NaN where a reading was
    problems = [
        (index, _problem(resistances[:, index], scale, index))
        for index in np.flatnonzero(wiring.enabled).tolist()
    ]
    found = [f"{wiring.label(index)}: {problem}" for index, problem in problems if problem]
    if found:
        raise PadCalibrationError(
            "cannot calibrate these pads: "
            + "; ".join(found)
            + ". Take everything off the hand, check the wires, and try again, or list the pad "
            "under 'disabled' in the hand's file"
        )
    return baseline


def _problem(samples: np.ndarray, scale: PadScale | None, index: int) -> str:
    """What is wrong with one input while nothing should touch it, or an empty string."""
    if np.isnan(samples).any():
        share = np.isnan(samples).mean()
        return f"open or shorted in {share:.0%} of the readings (unplugged or dead)"
    base = np.median(samples)
    scatter = np.median(np.abs(samples - base)) / base
    half = len(samples) // 2
    shift = abs(np.median(samples[:half]) - np.median(samples[half:])) / base
    if max(scatter, shift) > STEADY:
        return f"not steady, {max(scatter, shift):.1%} of change in 2 s (touched or moving)"
    if scale is not None and np.isfinite(scale.drop[index]):
        held = (scale.baseline[index] - base) / scale.drop[index]
        if held > PRESSED:
            return f"looks pressed with {held:.0%} of 6 N since before the calibration"
    return ""


def drop_under_press(
    resistances: np.ndarray, baseline: np.ndarray, index: int, wiring: PadWiring
) -> float:
    """Fall of one input's resistance [ohm] while a pad on it was pressed with 6 N.

    The press is the time in which the drop exceeds half its greatest value; the 20 % quantile there
    leaves out overshooting forces and what creep adds.

    Args:
        resistances: Resistances of all inputs from before to after the press [ohm], shape (T, N).
        baseline: Resistances untouched [ohm], shape (N,).
        index: The input that was to be pressed.
        wiring: The pads of the hand.

    Raises:
        PadCalibrationError: The input did not answer, or another one answered more.
    """
    falls = baseline - resistances  # (T, N)
    peaks = np.quantile(np.nan_to_num(falls, nan=0.0), 0.95, axis=0)
    relative = np.where(wiring.enabled, peaks / baseline, 0.0)
    strongest = int(np.argmax(relative))
    if strongest != index and relative[strongest] > LEAST_DROP:
        raise PadCalibrationError(
            f"{wiring.label(strongest)} answered to the press, not {wiring.label(index)}: wrong "
            "pad, or its wires are swapped with the other's"
        )
    if not relative[index] > LEAST_DROP:
        raise PadCalibrationError(
            f"{wiring.label(index)} changed by {max(relative[index], 0):.1%} only under the press: "
            "press its middle with 6 N (612 g on a kitchen scale), or the pad is dead"
        )
    plateau = falls[:, index][falls[:, index] > 0.5 * peaks[index]]
    return float(np.quantile(plateau, 0.2))


def save_scale(path: str | Path, scale: PadScale, wiring: PadWiring) -> None:
    """Write the bench calibration as YAML, by the pads' names."""
    pads = {
        name: {
            "baseline_ohm": round(float(scale.baseline[index]), 1),
            "drop_ohm": round(float(scale.drop[index]), 1),
        }
        for index, entry in enumerate(wiring.inputs)
        for name in entry.pads
        if np.isfinite(scale.drop[index])
    }
    text = yaml.safe_dump({"pads": pads}, sort_keys=False)
    header = (
        "# Resistance untouched and its fall under 6 N, by `python -m hardware calibrate-pads`\n"
    )
    write_text(Path(path), header + text)


def load_scale(path: str | Path, wiring: PadWiring) -> PadScale:
    """Read a bench calibration.

    Raises:
        ConfigError: It cannot be read, or lacks a pad that is not disabled.
    """
    if not Path(path).exists():
        raise ConfigError(f"there is no pad calibration {path} yet: {_ADVICE}")
    try:
        document = read_yaml(Path(path), ConfigError, "the pad calibration ")
    except ConfigError as error:
        raise ConfigError(f"{error}: {_ADVICE}") from error
    pads = document.get("pads") if isinstance(document, Mapping) else None
    if not isinstance(pads, Mapping):
        raise ConfigError(f"{path} holds no pad calibration, a mapping 'pads': {_ADVICE}")
    values = np.full((len(wiring.inputs), 2), np.nan)
    for index, entry in enumerate(wiring.inputs):
        name = entry.pads[0]
        if name in pads:
            values[index] = _entry(pads[name], f"{path}, {name}")
    lacking = np.flatnonzero(wiring.enabled & np.isnan(values[:, 1]))
    missing = [wiring.label(index) for index in lacking.tolist()]
    if missing:
        raise ConfigError(
            f"{path} lacks {', '.join(missing)}: {_ADVICE}, or list them under 'disabled' in the "
            "hand's file"
        )
    return PadScale(baseline=values[:, 0], drop=values[:, 1])


def _entry(entry: Any, where: str) -> tuple[float, float]:
    try:
        baseline, drop = float(entry["baseline_ohm"]), float(entry["drop_ohm"])
    except (TypeError, KeyError, ValueError) as error:
        raise ConfigError(f"{where}: needs the numbers baseline_ohm and drop_ohm") from error
    if not (0 < drop < baseline < np.inf):
        raise ConfigError(
            f"{where}: needs 0 < drop_ohm < baseline_ohm, got {drop:g} and {baseline:g}"
        )
    return baseline, drop


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


def pad_table(
    wiring: PadWiring, resistance: np.ndarray, first: np.ndarray, scale: PadScale | None
) -> list[str]:
    """What each input says, as lines of text.

    Args:
        wiring: The pads of the hand.
        resistance: Resistances now [ohm], shape (N,).
        first: Resistances untouched [ohm], shape (N,).
        scale: Their bench calibration, where there is one.
    """
    u = np.full(len(first), np.nan) if scale is None else pressure(resistance, first, scale.drop)
    lines = [f"{'pad':38} {'input':>5} {'ohm':>8} {'change':>7} {'of 6 N':>7}"]
    for index in range(len(first)):
        now = resistance[index]
        start = f"{wiring.label(index):38} {index:>5}"
        if not np.isfinite(now):
            lines.append(f"{start}  open or shorted: check its wire")
            continue
        change = (
            f"{100 * (now / first[index] - 1):>6.1f}%" if np.isfinite(first[index]) else "     ? "
        )
        share = f"{u[index]:>7.2f}" if np.isfinite(u[index]) else "      -"
        touched = "  CONTACT" if u[index] > wiring.threshold else ""
        off = "" if wiring.enabled[index] else "  disabled"
        lines.append(f"{start} {now:>8.0f} {change} {share}{touched}{off}")
    return lines


class BoardPads(PadDevice):
    """A hand's pads behind a pad board, calibrated for one run.

    Args:
        port: The board's serial port.
        wiring: The pads as the board sees them.
        scale: Their bench calibration.
        pad_names: The hand's pads, in the order in which states are wanted.

    Raises:
        PadBoardError: The board is not there or sends nothing.
    """

    def __init__(
        self, port: str, wiring: PadWiring, scale: PadScale, pad_names: Iterable[str]
    ) -> None:
        self._wiring, self._scale, self._names = wiring, scale, tuple(pad_names)
        self._detector: ContactDetector | None = None
        self._dead: dict[str, int] = {}  # readings without a pressure, by pad
        self._readings = 0
        self._board = PadBoard(port, inputs=len(wiring.inputs))
        try:
            self._board.wait()
        except BaseException:
            self._board.close()
            raise

    def prepare(self) -> str:
        """Measure the baseline, which takes 2 s.

        Raises:
            PadCalibrationError: Pads are touched, moving or dead; they are named.
            PadBoardError: The board was unplugged.
        """
        resistances = self._wiring.resistance(self._board.record(BASELINE_SECONDS))
        baseline = measure_baseline(resistances, self._wiring, self._scale)
        self._detector = ContactDetector(self._wiring, self._scale, baseline, self._names)
        return f"baseline of {len(self._names)} pads measured"

    def since(self, instant: float) -> list[tuple[float, PadState]]:
        """States of all pads after an instant [s]."""
        if self._detector is None:
            raise ValueError("call prepare() before since()")
        return [
            (reading.time, self._state(reading.values)) for reading in self._board.since(instant)
        ]

    def remarks(self) -> list[str]:
        """Frames lost, restarts, pads whose wire came off."""
        lines = [text] if (text := self._board.counts().diagnosis()) else []
        for name, dead in self._dead.items():
            lines.append(
                f"{name} was open or shorted in {dead} of {self._readings} readings: its contact bit was off and its "
                "pressure is recorded as 0; check its wire"
            )
        return lines

    def close(self) -> None:
        """Give the port back."""
        self._board.close()

    def _state(self, values: np.ndarray) -> PadState:
        assert self._detector is not None
        state = self._detector.update(values)
        self._readings += 1
        for index in np.flatnonzero(np.isnan(state.pressure)):
            name = self._names[index]
            if name not in self._wiring.disabled:
                if name not in self._dead:
                    log.warning("%s is open or shorted: check its wire", name)
                self._dead[name] = self._dead.get(name, 0) + 1
        return state
