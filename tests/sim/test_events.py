# SPDX-License-Identifier: MIT
"""Objects that slip and fall by physics, and whether the estimator notices."""

import numpy as np
import pytest
import trimesh

from benchmarks.events import noticed_events
from sim import events
from sim.calibration import CalibrationError
from sim.hands import load_description
from sim.sampling import sample_sequence
from sim.sequence import SequenceName, Settings, make_sequence
from sim.simulate import event_instant
from sim.world import World
from vtgtsam import ObjectModel, build_sdf
from vtgtsam.recording import read_recording


@pytest.fixture(scope="module")
def world():
    description = load_description()
    mesh = trimesh.creation.box((0.05, 0.06, 0.045))
    return World(
        description, description.load_hand(), ObjectModel("box", build_sdf(mesh, 64), mesh)
    )


@pytest.fixture(scope="module", params=events.EVENTS)
def happened(request, world):
    """An event, its trajectory and its true instant."""
    sequence = sample_sequence(world, "vary", np.random.default_rng(0), request.param)
    time = event_instant(world, sequence.trajectory, request.param)
    return request.param, sequence.trajectory, time


def test_it_happens_after_the_turn_by_the_truth(happened, world):
    event, t, time = happened
    assert events.BEGIN < time < t.time[-1]
    n = int(np.searchsorted(t.time, time - 1e-9))
    if event == "drop":
        assert t.contacts[n - 1].any() and not t.contacts[n:].any()
        fallen = t.T_wo[n, 2, 3] - t.T_wo[-1, 2, 3]
        assert fallen > 0.05  # [m]
        return
    place = events.place_in_hand(t.T_wh, t.T_wo, world.obj.center)
    then = int(np.searchsorted(t.time, time - events.SLIP_WITHIN))
    assert np.linalg.norm(place[n] - place[then]) > events.SLIP
    assert t.contacts[n].sum() >= 2  # it is still held


def test_it_is_noticed_within_half_a_second_and_nothing_else_before(happened, world):
    event, trajectory, time = happened
    error = CalibrationError.of_robot(3, len(world.hand.joint_names))
    noticed = noticed_events(world, trajectory, error, np.random.default_rng(0))
    before = [word for t, word in noticed if t < time - 0.5]
    assert before == ["grasped"]
    word = {"slip": "slipping", "drop": "dropped"}[event]
    first = next(t for t, found in noticed if found == word)
    assert abs(first - time) < 0.5


def at(*heights_mm):
    """Hands at rest, and objects above them, a sample each 0.1 s."""
    T_wo = np.tile(np.eye(4), (len(heights_mm), 1, 1))
    T_wo[:, 2, 3] = 1e-3 * np.array(heights_mm)
    return np.tile(np.eye(4), (len(heights_mm), 1, 1)), T_wo


def test_a_slip_is_when_the_object_has_moved_by_4_mm_within_half_a_second():
    T_wh, T_wo = at(0, 0, 3, 5, 5, 5, 5)
    time = events.BEGIN + 0.1 * np.arange(7)
    held = np.ones((7, 2), dtype=bool)
    found = events.instant("slip", time, T_wh, T_wo, held, np.zeros(3))
    assert found == pytest.approx(time[3])
    slow = events.instant("slip", 10 * time, T_wh, T_wo, held, np.zeros(3))
    assert slow is None


def test_a_drop_is_when_the_last_pad_lets_go_for_good():
    T_wh, T_wo = at(0, 0, 0, 0)
    bits = np.array([[1, 1], [0, 0], [1, 0], [0, 0]], dtype=bool)
    time = 0.1 * np.arange(4)
    assert events.instant("drop", time, T_wh, T_wo, bits, np.zeros(3)) == pytest.approx(0.3)
    assert events.instant("drop", time[:3], T_wh[:3], T_wo[:3], bits[:3], np.zeros(3)) is None


def test_an_unknown_event_is_refused(world):
    with pytest.raises(ValueError, match="slip, drop, got 'throw'"):
        sample_sequence(world, "vary", np.random.default_rng(0), "throw")


@pytest.mark.slow
def test_a_recording_says_what_happens_and_when(tmp_path):
    path = tmp_path / "a.mcap"
    make_sequence(Settings("vary", event="drop"), SequenceName("gelatin_box", 0), {1.0: path})
    info = read_recording(path).info
    assert info["event"] == "drop" and 10.5 < float(info["event_time"]) < 13.0
