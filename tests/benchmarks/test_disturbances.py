# SPDX-License-Identifier: MIT
"""What is done to a recording for the benchmarks of memory and faults, on a made-up grasp of 12 s."""

from types import SimpleNamespace

import gtsam
import numpy as np
import pytest

from benchmarks import disturbances, sensor_faults
from benchmarks.disturbances import CASES
from benchmarks.replay import Replay
from vtgtsam import Measurement, load_hand, load_object

HAND, CAN = load_hand("isyhand"), load_object("can", resolution=32)
SEEN = gtsam.Pose3(gtsam.Rot3.Rz(0.3), np.array([0.1, 0.0, 0.2]))


def moved(time):
    return gtsam.Pose3(gtsam.Rot3.Ry(0.1 * time), np.zeros(3))


@pytest.fixture(scope="module")
def replay():
    times = 0.033 * np.arange(364)
    bits = np.arange(len(HAND)) < 4
    frames = [
        Measurement(
            time=t,
            contacts=bits,
            joints=np.full(len(HAND.joint_names), 0.02 * t),
            T_wh=moved(t),
            T_wo_visual=moved(t).compose(SEEN),
            visual_covariance=np.eye(6),
        )
        for t in times
    ]
    truths = [frame.T_wo_visual for frame in frames]
    recording = SimpleNamespace(hand=HAND, object=CAN, info={}, path="made")
    return Replay(recording, frames, truths, np.array(["before"] * 364), None)


@pytest.mark.parametrize("case", CASES)
def test_nothing_changes_before_it_begins_and_the_given_frames_stay(replay, case):
    before = [frame.T_wo_visual for frame in replay.frames]
    disturbed = CASES[case](replay)
    begin = {"taken out": disturbances.TAKEN}.get(case, disturbances.BEGIN)
    early = replay.times < (0.09 if "late" in case else begin - 1e-9)
    for n in np.flatnonzero(early):
        assert disturbed.frames[n].T_wo_visual.equals(before[n], 0.0)
    assert all(a is b.T_wo_visual for a, b in zip(before, replay.frames, strict=True))
    assert len(disturbed.frames) == 364 and disturbed.judged.any()


def test_a_silence_is_of_two_seconds(replay):
    missing = [frame.time for frame in CASES["silent 2 s"](replay).frames if not frame.T_wo_visual]
    assert 1.95 < missing[-1] - missing[0] < 2.0 and missing[0] == pytest.approx(6.0, abs=0.033)


def test_a_flip_turns_the_object_over_in_its_place(replay):
    frame = CASES["flipped 1 s"](replay).frames[190]
    step = replay.frames[190].T_wo_visual.between(frame.T_wo_visual)
    assert np.linalg.norm(gtsam.Rot3.Logmap(step.rotation())) == pytest.approx(np.pi)
    centre = CAN.mesh.bounds.mean(axis=0)
    np.testing.assert_allclose(step.transformFrom(centre), centre, atol=1e-12)


def test_off_is_by_12_mm_and_14_degrees(replay):
    frame = CASES["off by 12 mm, 14 degrees, 1 s"](replay).frames[190]
    step = replay.frames[190].T_wo_visual.between(frame.T_wo_visual)
    centre = CAN.mesh.bounds.mean(axis=0)
    assert np.linalg.norm(step.transformFrom(centre) - centre) == pytest.approx(0.012)
    angle = np.linalg.norm(gtsam.Rot3.Logmap(step.rotation()))
    assert np.rad2deg(angle) == pytest.approx(14.0)


def test_late_vision_says_its_instant_or_not(replay):
    said, unsaid = (
        CASES[name](replay).frames[100] for name in ("100 ms late", "100 ms late, not said")
    )
    seen = replay.frames[97]
    assert said.T_wo_visual.equals(seen.T_wo_visual, 0.0) and said.visual_time == seen.time
    assert unsaid.T_wo_visual.equals(seen.T_wo_visual, 0.0) and unsaid.visual_time is None


def test_an_object_that_is_taken_out_leaves_an_open_hand_that_feels_nothing(replay):
    disturbed = CASES["taken out"](replay)
    last = disturbed.frames[-1]
    assert not np.any(last.contacts)
    np.testing.assert_allclose(last.joints, replay.frames[0].joints)
    lifted = disturbed.truths[-1].translation() - replay.truths[-1].translation()
    np.testing.assert_allclose(lifted, [0, 0, 0.15], atol=1e-9)
    assert last.T_wo_visual.equals(disturbed.truths[-1], 1e-9)


@pytest.mark.parametrize("name", [name for name in sensor_faults.FAULTS if name != "wrong object"])
def test_a_sensor_fails_from_the_middle_on(replay, name):
    fault = sensor_faults.FAULTS[name]
    frames = fault.frames(replay)
    middle = sensor_faults.first_frame(replay)
    assert frames[:middle] == replay.frames[:middle]
    assert any(frame is not given for frame, given in zip(frames, replay.frames, strict=True))
    shows = fault.shows(replay)
    assert shows is None or shows >= sensor_faults.BEGIN


def test_a_frozen_hand_shows_once_the_object_has_moved_by_10_degrees_or_10_mm(replay):
    shows = sensor_faults.FAULTS["hand frozen"].shows(replay)
    then = replay.truths[sensor_faults.first_frame(replay)]
    now = replay.truths[int(np.searchsorted(replay.times, shows))]
    step = then.between(now)
    assert 0.010 < np.linalg.norm(step.translation()) < 0.012
