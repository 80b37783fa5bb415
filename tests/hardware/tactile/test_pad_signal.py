# SPDX-License-Identifier: MIT
"""The emulated pads answer to force as the paper says of its pads."""

import numpy as np
import pytest

from hardware.emulate.pad_signal import PadParameters, PadSignal, in_parallel, random_parameters

DT = 0.02  # [s]


def one_pad(**options):
    values = dict(
        rest_ohm=10e3,
        drop=0.3,
        shear=0.02,
        overshoot=0.2,
        overshoot_seconds=0.5,
        creep=0.1,
        noise=0,
    )
    values.update(options)
    parameters = PadParameters(**{name: np.array([float(v)]) for name, v in values.items()})
    return PadSignal(parameters, np.random.default_rng(0))


@pytest.fixture(autouse=True)
def without_drift(monkeypatch):
    monkeypatch.setattr("hardware.emulate.pad_signal.DRIFT", 0.0)


def after(pad, normal, shear=0.0, seconds=DT):
    """Resistance after that time under a constant force, as fraction of that at rest."""
    for _ in range(round(seconds / DT)):
        resistance = pad.step(np.array([normal]), np.array([shear]), DT)
    return resistance[0] / 10e3


def test_six_newton_lower_the_resistance_by_the_drop_and_less_force_by_less():
    assert after(one_pad(creep=0), 6.0) == pytest.approx(0.7)
    assert after(one_pad(creep=0), 3.0) == pytest.approx(1 - 0.3 * 0.5**0.7)
    assert after(one_pad(), 0.0) == 1.0


def test_shear_raises_it_in_either_direction():
    assert after(one_pad(), 0.0, shear=2.0) == pytest.approx(1.04)
    assert after(one_pad(), 0.0, shear=-2.0) == pytest.approx(1.04)


def test_a_lasting_press_creeps():
    pad = one_pad()
    assert after(pad, 6.0) == pytest.approx(0.7, abs=0.001)
    assert after(pad, 6.0, seconds=40.0) == pytest.approx(0.7 - 0.1 * 0.3, abs=1e-4)


def test_a_release_overshoots_the_resistance_at_rest_for_a_while():
    pad = one_pad(creep=0)
    after(pad, 6.0)
    assert after(pad, 0.0) == pytest.approx(1 + 0.2 * 0.3)
    assert after(pad, 0.0, seconds=0.5) == pytest.approx(1 + 0.2 * 0.3 / np.e, rel=1e-3)
    assert after(pad, 0.0, seconds=5.0) == pytest.approx(1.0, abs=1e-4)


def test_noise_and_a_moved_baseline_have_the_size_that_is_asked_for():
    pad = one_pad(noise=0.005)
    readings = [after(pad, 0.0) for _ in range(2000)]
    assert np.std(readings) == pytest.approx(0.005, rel=0.1)
    many = PadSignal(random_parameters(np.arange(2000), np.random.default_rng(1)), pad._rng)
    many.move_baseline(0.06)
    rest = many.step(np.zeros(2000), np.zeros(2000), DT) / many.parameters.rest_ohm
    assert np.std(rest) == pytest.approx(0.06, rel=0.1)


def test_pads_in_parallel_conduct_together():
    inputs = in_parallel(np.array([10.0, 6.0, 3.0]), np.array([1, 0, 0]), 2)
    np.testing.assert_allclose(inputs, [2.0, 10.0])


def test_pads_on_one_input_are_of_one_size():
    parameters = random_parameters(np.repeat(np.arange(50), 2), np.random.default_rng(0))
    ratio = parameters.rest_ohm[::2] / parameters.rest_ohm[1::2]
    assert 0.6 < ratio.min() and ratio.max() < 1.6
    assert parameters.rest_ohm.max() / parameters.rest_ohm.min() > 5
