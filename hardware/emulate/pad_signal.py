# SPDX-License-Identifier: MIT
r"""How an emulated pad's resistance answers to force.

    R / R_0 = 1 - g(F) - creep + shear + overshoot + drift + noise,    g(F) = d_6 (F / 6 N)^0.7

Pressing lowers the resistance (d_6 is the fall under 6 N), slowly a little more under a lasting
press (creep); shear raises it; after a release it overshoots and comes back; the untouched value
wanders. The signs are those that the paper reports of its pads. The numbers are plausible and
invented: no real pad was measured, so nothing here is evidence about one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hardware.tactile.pressure import PadScale
from hardware.tactile.wiring import PadWiring

EXPONENT = 0.7


@dataclass(frozen=True, eq=False)
class PadParameters:
    """What differs between hand-made pads; each array has shape (K,).

    Attributes:
        rest_ohm: Resistance untouched [ohm].
        drop: Fraction by which 6 N lower it.
        shear: Fraction by which shear raises it [1 / N].
        overshoot: Part of a fall that shows as rise after the release.
        overshoot_seconds: Time constant of its decay [s].
        creep: Part of a fall that follows slowly under a lasting press.
        noise: Standard deviation of a reading, as fraction.
    """

    rest_ohm: np.ndarray
    drop: np.ndarray
    shear: np.ndarray
    overshoot: np.ndarray
    overshoot_seconds: np.ndarray
    creep: np.ndarray
    noise: np.ndarray


CREEP_SECONDS = 4.0  # [s]
DRIFT = 0.001  # standard deviation of the random walk after 1 s, as fraction


def random_parameters(input_of: np.ndarray, rng: np.random.Generator) -> PadParameters:
    """Parameters of pads as different as hand-made ones may be; those on one input are of one size.

    Args:
        input_of: The input of each pad, shape (K,).
        rng: Source of the differences.
    """
    count = len(input_of)
    size_ohm = np.exp(rng.uniform(np.log(2e3), np.log(32e3), input_of.max() + 1))
    return PadParameters(
        rest_ohm=size_ohm[input_of] * rng.uniform(0.8, 1.25, count),
        drop=rng.uniform(0.15, 0.50, count),
        shear=rng.uniform(0.01, 0.04, count),
        overshoot=rng.uniform(0.15, 0.35, count),
        overshoot_seconds=rng.uniform(0.3, 0.8, count),
        creep=rng.uniform(0.03, 0.10, count),
        noise=rng.uniform(0.002, 0.006, count),
    )


class PadSignal:
    """The pads' resistances, one step after another."""

    def __init__(self, parameters: PadParameters, rng: np.random.Generator) -> None:
        """Begin with nothing touched.

        Args:
            parameters: What the pads are like.
            rng: Source of noise and drift.
        """
        self.parameters = parameters
        self._rng = rng
        count = len(parameters.rest_ohm)
        self._fall = np.zeros(count)
        self._creep = np.zeros(count)
        self._overshoot = np.zeros(count)
        self._drift = np.zeros(count)

    def move_baseline(self, scatter: float) -> None:
        """Let the untouched resistances wander, as between the bench and a run.

        Args:
            scatter: Standard deviation of the change, as fraction.
        """
        self._drift += self._rng.normal(0.0, scatter, len(self._drift))

    def step(self, normal: np.ndarray, shear: np.ndarray, dt: float) -> np.ndarray:
        """Resistances [ohm], shape (K,), after one more interval.

        Args:
            normal: Normal force on each pad [N], shape (K,).
            shear: Shear force on each pad [N], shape (K,).
            dt: Length of the interval [s].
        """
        pad = self.parameters
        fall = pad.drop * (np.maximum(normal, 0.0) / 6.0) ** EXPONENT
        released = np.maximum(self._fall - fall, 0.0)
        self._fall = fall
        self._overshoot *= np.exp(-dt / pad.overshoot_seconds)
        self._overshoot += pad.overshoot * released
        self._creep += (pad.creep * fall - self._creep) * (1.0 - np.exp(-dt / CREEP_SECONDS))
        count = len(fall)
        self._drift += self._rng.normal(0.0, DRIFT * np.sqrt(dt), count)
        noise = pad.noise * self._rng.standard_normal(count)
        ratio = 1.0 - fall - self._creep + pad.shear * np.abs(shear)
        ratio = ratio + self._overshoot + self._drift + noise
        return np.asarray(pad.rest_ohm * np.maximum(ratio, 0.02))


def in_parallel(resistances: np.ndarray, input_of: np.ndarray, inputs: int) -> np.ndarray:
    """Resistance of each input [ohm], shape (N,), whose pads hang in parallel.

    Args:
        resistances: Resistance of each pad [ohm], shape (K,).
        input_of: The input of each pad, shape (K,).
        inputs: How many inputs there are.
    """
    return 1.0 / np.bincount(input_of, weights=1.0 / resistances, minlength=inputs)


def pad_parameters(wiring: PadWiring, seed: np.random.SeedSequence) -> PadParameters:
    """What the emulated pads are like."""
    return random_parameters(wiring.input_of(wiring.pad_names), np.random.default_rng(seed))


def bench_scale(wiring: PadWiring, parameters: PadParameters) -> PadScale:
    """What a calibration of these pads would find.

    Of pads in parallel the less sensitive one counts, as in the wizard.
    """
    input_of, count = wiring.input_of(wiring.pad_names), len(wiring.inputs)
    baseline = in_parallel(parameters.rest_ohm, input_of, count)
    drop = np.full(count, np.inf)
    for pad, index in enumerate(input_of):
        pressed = parameters.rest_ohm.copy()
        pressed[pad] *= 1.0 - parameters.drop[pad]
        drop[index] = min(drop[index], (baseline - in_parallel(pressed, input_of, count))[index])
    return PadScale(baseline, drop)
