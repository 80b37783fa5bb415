# SPDX-License-Identifier: MIT
"""A hand of 16 invented pads on 14 inputs, and grasps of it, for the tests of the pads."""

import numpy as np

from hardware.emulate.pad_signal import PadSignal, in_parallel, random_parameters
from hardware.tactile.frame import FULL_SCALE
from hardware.tactile.wiring import PadInput, PadWiring

DT = 0.02  # [s]
FINGER_PADS = tuple(
    f"pad_{f}_{link}" for f in ("index", "middle", "ring", "thumb") for link in "pmd"
)
PALM_PADS = ("pad_palm_inner_1", "pad_palm_inner_2"), ("pad_palm_outer_1", "pad_palm_outer_2")
PADS = (*FINGER_PADS, *PALM_PADS[0], *PALM_PADS[1])


def wiring(rest_ohm=None, **options):
    """The wiring, each reference resistor as large as its input's untouched resistance."""
    names = (*((name,) for name in FINGER_PADS), *PALM_PADS)
    ohms = np.full(14, 10e3) if rest_ohm is None else rest_ohm
    inputs = [PadInput(pads=n, reference_ohm=o) for n, o in zip(names, ohms, strict=True)]
    return PadWiring(inputs=inputs, **options)


class EmulatedPads:
    """Pads, divider and converter without board, line and waiting: forces in, readings out."""

    def __init__(self, seed, **options):
        rng = np.random.default_rng(seed)
        self.input_of = wiring().input_of(PADS)
        self.parameters = random_parameters(self.input_of, rng)
        self.signal = PadSignal(self.parameters, rng)
        self.wiring = wiring(in_parallel(self.parameters.rest_ohm, self.input_of, 14), **options)

    def readings(self, normal, shear=None):
        """The board's readings, shape (T, 14), under forces [N] of shape (T, 16)."""
        shear = np.zeros_like(normal) if shear is None else shear
        pads = np.array([self.signal.step(n, s, DT) for n, s in zip(normal, shear, strict=True)])
        inputs = np.array([in_parallel(row, self.input_of, 14) for row in pads])
        share = inputs / (inputs + self.wiring.reference_ohm)
        return np.rint(share * FULL_SCALE).astype(np.uint16)

    def resistances(self, normal, shear=None):
        return self.wiring.resistance(self.readings(normal, shear))


def untouched(seconds):
    return np.zeros((round(seconds / DT), len(PADS)))


def press(pad, force=6.0, seconds=5.0, hold=3.0):
    """Somebody presses one pad in the middle of that time: forces [N], shape (T, 16)."""
    forces = untouched(seconds)
    time = DT * np.arange(len(forces)) - 0.5 * (seconds - hold)
    rise = np.clip(np.minimum(time, hold - time) / 0.2, 0.0, 1.0)
    forces[:, PADS.index(pad)] = force * rise
    return forces


def grasp(rng, seconds=20.0):
    """Normal and shear forces [N] of one grasp: pads touch after 5 s and let go after 14 s."""
    normal, shear = untouched(seconds), untouched(seconds)
    time = DT * np.arange(len(normal))
    for pad in np.flatnonzero(rng.random(len(PADS)) < 0.75):
        ramp = rng.uniform(0.05, 0.2)
        begin, end = rng.uniform(5.0, 8.0), rng.uniform(14.0, 17.0)
        hold = np.clip(np.minimum(time - begin, end - time) / ramp, 0.0, 1.0)
        sway = 1.0 + 0.1 * np.sin(2.0 * np.pi * rng.uniform(0.1, 0.5) * time)
        normal[:, pad] = rng.uniform(1.0, 6.0) * hold * sway
        shear[:, pad] = rng.uniform(0.0, 0.5) * normal[:, pad]
    return normal, shear
