# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from pad_hand import DT, PADS, EmulatedPads, press, untouched, wiring

from hardware.tactile.pressure import (
    PadCalibrationError,
    PadScale,
    drop_under_press,
    load_scale,
    measure_baseline,
    pressure,
    save_scale,
)
from hardware.tactile.wiring import PadWiring
from vtgtsam.exceptions import ConfigError


def test_only_drops_below_the_baseline_count_in_units_of_a_6_newton_press():
    resistance = np.array([10e3, 9e3, 8e3, 12e3, np.nan])
    base, drop = np.full(5, 10e3), np.full(5, 2e3)
    np.testing.assert_allclose(
        pressure(resistance, base, drop), [0.0, 0.5, 1.0, 0.0, np.nan], rtol=1e-12
    )


def test_readings_become_resistances_and_open_or_shorted_inputs_nan():
    hand = wiring(np.array([10e3] * 14))
    readings = np.full(14, round(0.75 * 65535), dtype=np.uint16)
    readings[:3] = 0, 65535, 65400
    resistance = hand.resistance(readings)
    assert np.isnan(resistance[:3]).all()
    np.testing.assert_allclose(resistance[3:], 30e3, rtol=1e-4)  # 3/4 of the supply: 3 x reference


def test_the_baseline_is_the_resistance_at_rest():
    for seed in range(10):
        pads = EmulatedPads(seed)
        baseline = measure_baseline(pads.resistances(untouched(2.0)), pads.wiring)
        np.testing.assert_allclose(baseline, pads.wiring.reference_ohm, rtol=0.01)


def test_a_pad_touched_during_the_baseline_is_refused_by_name():
    pads = EmulatedPads(0)
    forces = untouched(2.0)
    forces[40:, PADS.index("pad_ring_m")] = 1.0
    with pytest.raises(PadCalibrationError, match=r"pad_ring_m: not steady.*Take everything off"):
        measure_baseline(pads.resistances(forces), pads.wiring)


def test_a_pad_that_is_rubbed_is_refused():
    pads = EmulatedPads(1)
    forces = untouched(2.0)
    forces[:, 4] = 1.0 + np.sin(2 * np.pi * 3.0 * DT * np.arange(len(forces)))
    with pytest.raises(PadCalibrationError, match=rf"{PADS[4]}: not steady"):
        measure_baseline(pads.resistances(forces), pads.wiring)


def test_a_pad_with_a_loose_wire_is_refused_though_its_median_stays():
    resistances = np.full((100, 14), 10e3)
    resistances[:, 9] *= 1.0 + 0.05 * np.sin(np.arange(100))
    with pytest.raises(PadCalibrationError, match=rf"{PADS[9]}: not steady"):
        measure_baseline(resistances, wiring())


def test_an_unplugged_and_a_shorted_pad_are_refused_together():
    pads = EmulatedPads(2)
    readings = pads.readings(untouched(2.0))
    readings[:, 3], readings[7, 5] = 65535, 0
    with pytest.raises(PadCalibrationError) as error:
        measure_baseline(pads.wiring.resistance(readings), pads.wiring)
    assert f"{PADS[3]}: open or shorted in 100%" in str(error.value)
    assert f"{PADS[5]}: open or shorted in 1%" in str(error.value)


def test_a_pad_pressed_all_the_while_is_refused_where_the_bench_knows_better():
    pads = EmulatedPads(3)
    bench = measure_baseline(pads.resistances(untouched(2.0)), pads.wiring)
    peaks = [pads.resistances(press(name)) for name in PADS[:12]]
    drop = [drop_under_press(r, bench, i, pads.wiring) for i, r in enumerate(peaks)]
    scale = PadScale(baseline=bench, drop=np.array([*drop, np.nan, np.nan]))
    held = untouched(2.0)
    held[:, 6] = 5.0
    pads.signal.step(held[0], 0 * held[0], 5.0)  # its creep is over
    with pytest.raises(PadCalibrationError, match=rf"{PADS[6]}: looks pressed with \d+% of 6 N"):
        measure_baseline(pads.resistances(held), pads.wiring, scale)


def test_a_dead_pad_does_not_matter_where_it_is_disabled():
    pads = EmulatedPads(4, disabled=frozenset({PADS[3]}))
    readings = pads.readings(untouched(2.0))
    readings[:, 3] = 65535
    baseline = measure_baseline(pads.wiring.resistance(readings), pads.wiring)
    assert np.isnan(baseline[3]) and np.isfinite(np.delete(baseline, 3)).all()


def test_the_scale_is_the_drop_under_the_press():
    for seed in range(10):
        pads = EmulatedPads(seed)
        baseline = measure_baseline(pads.resistances(untouched(2.0)), pads.wiring)
        drop = drop_under_press(pads.resistances(press(PADS[2])), baseline, 2, pads.wiring)
        expected = pads.parameters.drop[2] * pads.parameters.rest_ohm[2]
        assert 0.95 < drop / expected < 1.12  # creep adds up to 10 %


def test_pressing_another_pad_than_asked_is_noticed():
    pads = EmulatedPads(5)
    baseline = measure_baseline(pads.resistances(untouched(2.0)), pads.wiring)
    with pytest.raises(
        PadCalibrationError, match=f"{PADS[8]} answered to the press, not {PADS[2]}"
    ):
        drop_under_press(pads.resistances(press(PADS[8])), baseline, 2, pads.wiring)


def test_a_pad_that_does_not_answer_to_the_press_is_refused():
    pads = EmulatedPads(6)
    baseline = measure_baseline(pads.resistances(untouched(2.0)), pads.wiring)
    with pytest.raises(PadCalibrationError, match=f"{PADS[2]} changed by .*% only"):
        drop_under_press(pads.resistances(untouched(5.0)), baseline, 2, pads.wiring)


def test_the_bench_calibration_survives_its_file(tmp_path):
    hand = wiring(disabled=frozenset({PADS[0]}))
    drop = np.linspace(1e3, 3e3, 14)
    drop[0] = np.nan
    save_scale(tmp_path / "pads.yaml", PadScale(np.linspace(8e3, 9e3, 14), drop), hand)
    loaded = load_scale(tmp_path / "pads.yaml", hand)
    np.testing.assert_allclose(loaded.drop, drop, atol=0.05)  # rounded to 0.1 ohm
    np.testing.assert_allclose(loaded.baseline[1:], np.linspace(8e3, 9e3, 14)[1:], atol=0.051)


def test_a_file_without_a_needed_pad_says_which_and_what_to_do(tmp_path):
    drop = np.full(14, 2e3)
    drop[13] = np.nan
    save_scale(tmp_path / "pads.yaml", PadScale(np.full(14, 9e3), drop), wiring())
    with pytest.raises(ConfigError, match="lacks pad_palm_outer_1 and pad_palm_outer_2: run"):
        load_scale(tmp_path / "pads.yaml", wiring())


@pytest.mark.parametrize(
    "text, message",
    [
        ("pads: [", "the pad calibration .* is not valid YAML"),
        ("{}", "holds no pad calibration"),
        ("pads: {pad_index_p: {baseline_ohm: 9e3}}", "pad_index_p: needs the numbers"),
        ("pads: {pad_index_p: {baseline_ohm: 9.0, drop_ohm: -2}}", "needs 0 < drop_ohm"),
    ],
)
def test_a_broken_file_is_refused_in_one_sentence(tmp_path, text, message):
    path = tmp_path / "pads.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=message):
        load_scale(path, wiring())


def test_the_wiring_reads_as_it_is_written_in_a_hand_s_file():
    hand = PadWiring.model_validate(
        {
            "inputs": [
                {"pads": ["a"], "reference_ohm": 10000},
                {"pads": ["b", "c"], "reference_ohm": 4.7e3},
            ],
            "disabled": ["a"],
            "release": 0.08,
        }
    )
    assert hand.pad_names == ("a", "b", "c")
    assert (hand.threshold, hand.release) == (0.15, 0.08)
    assert hand.input_of(["c", "a", "b"]).tolist() == [1, 0, 1]
    assert hand.enabled.tolist() == [False, True]


A = {"pads": ["a"], "reference_ohm": 1e4}


@pytest.mark.parametrize(
    "section, message",
    [
        ({}, "inputs\n.*required"),
        ({"inputs": [A], "treshold": 0.1}, "treshold\n.*not permitted"),
        ({"inputs": []}, "at least 1 item"),
        ({"inputs": [A, A]}, "each pad is on one input; on more: a"),
        ({"inputs": [{"pads": [], "reference_ohm": 1}]}, "at least 1 item"),
        ({"inputs": [{"pads": ["a"], "reference_ohm": 0}]}, "greater than 0"),
        ({"inputs": [A], "disabled": ["b"]}, "disabled, but on no input: b"),
        ({"inputs": [A], "threshold": 0.1, "release": 0.2}, "release must not exceed"),
        ({"inputs": [A], "threshold": "high"}, "threshold\n.*valid number"),
    ],
)
def test_a_wrong_wiring_is_refused_with_the_place(section, message):
    with pytest.raises(ValueError, match=message):
        PadWiring.model_validate(section)


def test_inputs_must_be_the_pads_of_the_hand():
    with pytest.raises(ConfigError, match="missing: pad_new; not of this hand: pad_thumb_d"):
        wiring().input_of([*(name for name in PADS if name != "pad_thumb_d"), "pad_new"])
