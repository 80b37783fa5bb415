# SPDX-License-Identifier: MIT
"""Which instants are fused, and that a reader of the recording finds what was."""

from __future__ import annotations

import gtsam
import numpy as np
import pytest

from vtgtsam import EstimatorConfig, PoseEstimator, load_hand, load_object, read_recording
from vtgtsam.live.fusion import LATENCY, Fusion, vision_hold
from vtgtsam.live.inputs import FLOWING_NS, Inputs
from vtgtsam.live.recorder import Recorder
from vtgtsam.recording import RecordingWriter, names
from vtgtsam.recording.provenance import mesh_file, object_metadata

MS = 1_000_000
NEAR = gtsam.Pose3(gtsam.Rot3(), np.array([0.09, 0.15, 0.5]))
T_WH = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.1, -0.2, 0.3), np.array([0.0, 0.1, 0.4]))


@pytest.fixture(scope="module")
def hand():
    return load_hand("isyhand")


@pytest.fixture(scope="module")
def can():
    return load_object("can")


class Bench:
    """A fusion whose inputs and clock are in the test's hands; times are in ms from ``origin``."""

    def __init__(self, hand, obj, recorder=None, config=None, origin=0, hand_moves=False):
        self.hand, self.origin, self.now = hand, origin, origin
        estimator = PoseEstimator(hand, obj, config)
        self.recorder = recorder or Recorder(None)
        self.inputs = Inputs(
            hand.joint_names,
            hand.pad_names,
            lambda: self.now,
            self.recorder,
            hold_ns=round(1e9 * vision_hold(estimator)),
            hand_moves=hand_moves,
            steady=lambda: self.now,
        )
        self.fusion = Fusion(
            self.inputs, estimator, lambda: self.now, rate=50.0, steady=lambda: self.now
        )

    def ns(self, ms):
        return self.origin + round(ms * MS)

    def joints(self, ms, angle=0.1, some=slice(None)):
        names_ = self.hand.joint_names[some]
        return self.inputs.put_joints(self.ns(ms), names_, [angle] * len(names_))

    def pads(self, ms, touching=()):
        bits = np.isin(np.arange(len(self.hand)), touching)
        return self.inputs.put_contacts(self.ns(ms), self.hand.pad_names, bits.tolist())

    def hand_pose(self, ms, T_wh=T_WH):
        return self.inputs.put_hand_pose(self.ns(ms), T_wh)

    def vision(self, ms, T_wo=NEAR, covariance=None):
        return self.inputs.put_vision(self.ns(ms), T_wo, covariance)

    def at(self, ms):
        self.now = self.ns(ms)
        return self

    def step(self, ms):
        estimate = self.at(ms).fusion.step()
        return None if estimate is None else round(1000 * (estimate.time - self.origin / 1e9))


@pytest.fixture
def bench(hand, can):
    return Bench(hand, can)


def begun(bench):
    bench.joints(0)
    bench.pads(0)
    bench.vision(0)
    assert bench.step(1) == 0
    return bench


def test_the_first_frame_stands_at_the_instant_of_the_first_image(bench):
    for ms in (0, 10, 20, 100):
        bench.joints(ms)
        bench.pads(ms)
    assert bench.step(101) is None
    bench.vision(12)
    assert bench.step(102) == 12
    assert bench.fusion.last.status == "ok"
    assert bench.step(103) == 100  # and the next is in the present


def test_an_image_from_before_the_first_joints_begins_nothing(bench):
    bench.joints(50)
    bench.pads(50)
    bench.vision(20)
    assert bench.step(60) is None
    bench.vision(50)
    assert bench.step(61) == 50


def test_a_frame_stands_where_all_that_flows_is_known(bench):
    begun(bench)
    bench.joints(40)
    assert bench.step(41) is None  # pads are still to come
    bench.pads(35)
    assert bench.step(42) == 35
    bench.joints(41, some=slice(0, 3))  # other joints are of 40
    bench.pads(60)
    assert bench.step(61) is None  # 40 is too soon after 35
    bench.joints(57, some=slice(3, None))
    assert bench.step(62) is None  # and so is 41
    bench.joints(62)
    assert bench.step(63) == 60


def test_a_visual_pose_that_waits_brings_the_next_frame_forward(bench):
    begun(bench)
    for ms in (6, 12):
        bench.joints(ms)
        bench.pads(ms)
        assert bench.step(ms) is None  # of 50 a second, the next is due at 20
    bench.vision(5)
    assert bench.step(13) == 12
    bench.joints(20)
    bench.pads(20)
    assert bench.step(21) is None  # and the one after that at 32


def test_a_hand_that_moves_is_waited_for_and_one_that_fell_silent_is_not(hand, can):
    bench = Bench(hand, can, hand_moves=True)
    bench.joints(0)
    bench.pads(0)
    bench.vision(0)
    assert bench.step(1) is None  # where is the hand?
    bench.hand_pose(0)
    bench.hand_pose(1, gtsam.Pose3())
    assert bench.step(2) == 0
    for ms in (30, 60):
        bench.joints(ms)
        bench.pads(ms)
    assert bench.step(61) is None
    bench.at(62).hand_pose(40)
    assert bench.step(62) == 40
    assert bench.step(63) is None
    assert bench.step(62 + FLOWING_NS / MS + 1) == 60


def test_a_late_pose_is_fused_at_its_own_instant(hand, can):
    """A hand that moves by 0.5 m/s: a pose of 80 ms ago, taken for one of now, would be 40 mm off."""
    bench = Bench(hand, can, hand_moves=True)

    def at(ms):
        return gtsam.Pose3(gtsam.Rot3(), np.array([0.5 * ms / 1000, 0.0, 0.0])) * T_WH

    T_ho = T_WH.between(NEAR * gtsam.Pose3(gtsam.Rot3(), np.array([0.0, 0.0, 0.3])))  # untouched
    for ms in range(0, 600, 10):
        bench.at(ms)
        for put in (bench.joints, bench.pads):
            put(ms)
        bench.hand_pose(ms, at(ms))
        if ms >= 80 and ms % 30 == 20:
            bench.vision(ms - 80, at(ms - 80) * T_ho)
        bench.fusion.step()
    last = bench.fusion.last
    truth = at(1000 * last.time) * T_ho
    assert np.linalg.norm(last.T_wo.translation() - truth.translation()) < 1e-4
    assert last.faults == ()


def test_the_latency_counts_from_the_message_that_completed_the_frame(bench):
    begun(bench)
    bench.at(40).joints(39)
    bench.at(45).pads(41)
    bench.at(48)
    bench.fusion.step()
    assert bench.fusion.latencies._seconds[LATENCY][-1] == pytest.approx(0.003)


def test_begun_anew_it_starts_at_the_next_image(bench):
    begun(bench)
    bench.joints(100)
    bench.pads(100)
    bench.fusion.restart()
    assert bench.step(101) is None
    bench.vision(95, NEAR.retract(np.full(6, 0.1)))
    assert bench.step(102) == 95
    assert bench.fusion.started == 1
    assert np.linalg.norm(bench.fusion.last.T_wo.translation() - NEAR.translation()) > 0.05


def test_a_clock_that_goes_back_begins_anew_and_keeps_what_stands_still(hand, can):
    bench = Bench(hand, can, origin=3600 * 10**9, hand_moves=True)
    bench.hand_pose(0)
    begun(bench)
    for ms in range(-50_000, -49_000, 10):
        bench.joints(ms)
        bench.pads(ms)
        if ms % 30 == 0:
            bench.vision(ms)
        bench.step(ms)
    assert bench.inputs.generation >= 1
    assert "went back by 5" in bench.inputs.forgotten
    assert -49_030 <= round(1000 * (bench.fusion.last.time - 3600)) <= -49_010


def played(bench, rng, seconds=3.0, late=80.0):
    """A robot of several paces, some of it lost or late, tracked 80 ms late and out of order; the live estimates."""
    joints, count = bench.hand.joint_names, len(bench.hand)
    events = []
    for k in range(int(100 * seconds)):
        stamp = 10 * k + rng.uniform(0, 3)
        if rng.random() > 0.03:
            events.append(
                (stamp + rng.uniform(1, 15), bench.joints, (stamp, 0.001 * k, slice(0, 5)))
            )
        other = stamp + rng.uniform(0, 2)
        events.append(
            (other + rng.uniform(1, 15), bench.joints, (other, 0.001 * k, slice(5, len(joints))))
        )
    for k in range(int(50 * seconds)):
        stamp = 20 * k + rng.uniform(0, 3)
        touching = rng.choice(count, 3) if rng.random() > 0.5 else ()
        events.append((stamp + rng.uniform(2, 30), bench.pads, (stamp, touching)))
    for k in range(int(80 * seconds)):
        stamp = 12.5 * k
        T_wh = T_WH.retract(np.full(6, 1e-4 * k))
        events.append((stamp + rng.uniform(1, 5), bench.hand_pose, (stamp, T_wh)))
    for k in range(int(30 * seconds)):
        stamp = 33.3 * k
        seen = T_WH.retract(np.full(6, 1e-4 * stamp / 12.5)) * T_WH.between(NEAR)
        covariance = np.diag(rng.uniform(1e-6, 1e-5, 6)) if k % 2 else np.zeros((6, 6))
        arguments = (stamp, seen.retract(rng.normal(0, 2e-3, 6)), covariance)
        if not 30 < k < 45:  # the tracker loses it for half a second
            events.append((stamp + late + rng.uniform(-25, 25), bench.vision, arguments))
    live = []
    for due, put, arguments in sorted(events, key=lambda event: event[0]):
        bench.at(due)
        put(*arguments)
        estimate = bench.fusion.step()
        if estimate is not None:
            live.append(estimate)
    return live


@pytest.mark.parametrize("origin", [0, 1_764_000_000 * 10**9 + 123_456_789])
@pytest.mark.parametrize("config", [EstimatorConfig(), EstimatorConfig.simulation()])
def test_a_replay_gives_the_same_poses_to_the_last_bit(tmp_path, hand, can, config, origin):
    path = tmp_path / "run.mcap"
    hold = vision_hold(PoseEstimator(hand, can, config))
    metadata = {**object_metadata(can), "hand": "isyhand", names.VISION_HOLD: repr(hold)}
    writer = RecordingWriter(path, metadata, hand_xml=hand.xml, mesh=mesh_file(can))
    with Recorder(writer) as recorder:
        bench = Bench(hand, can, recorder, config, origin, hand_moves=True)
        live = played(bench, np.random.default_rng(5))
    assert len(live) > 100
    assert sum(bench.inputs.refused(stream) for stream in ("joints", "contacts")) > 5

    recording = read_recording(path)
    measurements = recording.measurements(rate="recorded")
    assert [m.time for m in measurements] == [estimate.time for estimate in live]
    late = [m.time - m.visual_time for m in measurements if m.T_wo_visual is not None]
    assert 0.05 < np.median(late) < 0.15
    estimator = PoseEstimator(recording.hand, recording.object, config)
    for measurement, estimate in zip(measurements, live, strict=True):
        replayed = estimator.update(measurement)
        np.testing.assert_array_equal(replayed.T_wo.matrix(), estimate.T_wo.matrix())
        assert (replayed.status, replayed.faults) == (estimate.status, estimate.faults)


def test_a_run_that_begins_anew_goes_on_in_a_recording_of_its_own(tmp_path, hand, can):
    paths = (tmp_path / f"run_{k}.mcap" for k in range(9))
    metadata = {**object_metadata(can), "hand": "isyhand", names.VISION_HOLD: "0.0"}

    def another():
        return RecordingWriter(next(paths), metadata, hand_xml=hand.xml, mesh=mesh_file(can))

    live = {}
    with Recorder(None, another) as recorder:
        bench = Bench(hand, can, recorder, hand_moves=True)
        rng = np.random.default_rng(6)
        live["none"] = played(bench, rng, 0.5)  # not recorded
        recorder.begin_another(always=True)
        bench.inputs.rewrite()
        bench.fusion.restart()
        bench.origin += 10**9
        live["run_1"] = played(bench, rng, 1.0)
        bench.origin -= 3600 * 10**9 - 7200 * 10**9
        bench.inputs.forget("a test")
        live["run_2"] = played(bench, rng, 1.0)
    for name in ("run_1", "run_2"):
        recording = read_recording(tmp_path / f"{name}.mcap")
        estimator = PoseEstimator(hand, can)
        replayed = [estimator.update(m) for m in recording.measurements(rate="recorded")]
        assert len(replayed) == len(live[name]) > 20
        for a, b in zip(replayed, live[name], strict=True):
            np.testing.assert_allclose(a.T_wo.matrix(), b.T_wo.matrix(), atol=1e-8)
