# SPDX-License-Identifier: MIT
"""The fusion's choice of instants, and that a reader of the recording finds what it fused."""

from __future__ import annotations

import gtsam
import numpy as np
import pytest

from hardware.device import PadState
from hardware.live.fusion import LATE_NS, PATIENCE_NS, STREAMS, Fusion, as_recorded
from hardware.live.recorder import Recorder
from hardware.live.streams import RunClock, Streams
from vtgtsam import EstimatorConfig, PoseEstimator, load_hand, load_object, read_recording
from vtgtsam.recording import RecordingWriter, names
from vtgtsam.recording.provenance import mesh_file, object_metadata

MS = 1_000_000


class FakeClock:
    """Monotonic time that the test sets [s]."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        return self.now


@pytest.fixture(scope="module")
def hand():
    return load_hand("isyhand")


@pytest.fixture(scope="module")
def can():
    return load_object("can")


class Bench:
    """A fusion whose streams and clock are in the test's hands."""

    def __init__(self, hand, obj, writer=None):
        self.hand, self.time = hand, FakeClock()
        self.streams = Streams(STREAMS)
        self.recorder = Recorder(writer)
        self.T_wh = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.1, -0.2, 0.3), np.array([0.0, 0.1, 0.4]))
        self.estimator = PoseEstimator(hand, obj, EstimatorConfig.tuned())
        self.fusion = Fusion(
            self.streams, self.estimator, self.T_wh, RunClock(self.time), self.recorder
        )
        self.recorder.write("hand_pose", 0, self.T_wh)

    def joints(self, ms, angle=0.1):
        q, names_ = np.full(len(self.hand.joint_names), angle), self.hand.joint_names
        return self.streams.put(
            "joints",
            ms * MS,
            q,
            lambda: self.recorder.write("joint_states", ms * MS, names_, q),
        )

    def pads(self, ms, touching=()):
        bits = np.isin(np.arange(len(self.hand)), touching)
        return self.streams.put(
            "pads",
            ms * MS,
            PadState(1.0 * bits, bits),
            lambda: self.recorder.write("tactile", ms * MS, self.hand.pad_names, 1.0 * bits, bits),
        )

    def image(self, ms, T_wo=None):
        if T_wo is not None:
            self.streams.put(
                "vision",
                ms * MS,
                as_recorded(T_wo),
                lambda: self.recorder.write("object_pose", ms * MS, T_wo),
            )
        return self.streams.put("images", ms * MS, None)

    def step(self, ms):
        self.time.now = ms / 1000
        estimate = self.fusion.step()
        return None if estimate is None else round(1000 * estimate.time)


@pytest.fixture
def bench(hand, can):
    return Bench(hand, can)


NEAR = gtsam.Pose3(gtsam.Rot3(), np.array([0.09, 0.15, 0.5]))


def test_an_image_is_fused_at_its_own_instant_once_joints_and_pads_have_passed_it(bench):
    for ms in (0, 20):
        bench.joints(ms, ms / 100)
        bench.pads(ms)
    bench.image(30, NEAR)
    assert bench.step(32) is None
    bench.joints(40, 0.4)
    assert bench.step(42) is None  # pads are still to come
    bench.pads(41)
    assert bench.step(43) == 30
    assert bench.step(44) is None  # and only once


def test_an_image_does_not_wait_for_ever(bench):
    bench.joints(0)
    bench.pads(0)
    bench.image(30, NEAR)
    assert bench.step(35) is None
    assert bench.step(35 + PATIENCE_NS // MS + 1) == 30
    assert not bench.joints(25)  # what comes now would change what was fused


def test_nothing_is_fused_with_joints_that_are_too_old(bench):
    bench.joints(0)
    bench.pads(180)
    bench.image(100, NEAR)
    assert bench.step(150) is None
    assert bench.step(201) is None


def test_nothing_is_fused_before_the_object_was_first_seen(bench):
    bench.joints(40)
    bench.pads(40)
    bench.image(30)
    assert bench.step(45) is None


def test_without_images_it_goes_on_at_30_hz_in_the_present(bench):
    bench.joints(0)
    bench.pads(0)
    bench.image(0, NEAR)
    assert bench.step(1) == 0
    fused = []
    for ms in range(20, 2000, 20):
        bench.joints(ms)
        bench.pads(ms)
        fused.append((ms, bench.step(ms)))
    at = {ms: instant for ms, instant in fused if instant is not None}
    assert min(at) > LATE_NS // MS  # images might only be slow
    assert all(instant <= ms - LATE_NS // MS for ms, instant in at.items() if ms < 1000)
    late = [instant for ms, instant in at.items() if ms > 1100]
    assert late == list(range(late[0], late[-1] + 1, 40))  # every second of the 50 Hz samples
    assert at[max(at)] == max(at)


def test_a_replay_finds_the_same_poses(tmp_path, hand, can):
    """Samples of random delays, some too late, some images without a pose."""
    rng = np.random.default_rng(5)
    path = tmp_path / "run.mcap"
    metadata = {**object_metadata(can), "hand": "isyhand", names.VISION_HOLD: "0.2"}
    writer = RecordingWriter(path, metadata, hand_xml=hand.xml, mesh=mesh_file(can))
    bench = Bench(hand, can, writer)
    events = []
    for k in range(100):
        stamp = 20 * k + int(rng.integers(0, 4))
        touching = rng.choice(len(hand), 3)
        events.append((stamp + rng.uniform(2, 60), bench.joints, (stamp, 0.002 * k)))
        events.append((stamp + rng.uniform(2, 30), bench.pads, (stamp, touching)))
    for k in range(60):
        stamp = 33 * k + 40
        T_wo = None if 30 < k < 45 or k % 7 == 3 else NEAR.retract(rng.normal(0, 2e-3, 6))
        if k not in (50, 51, 52):
            events.append((stamp + rng.uniform(10, 90), bench.image, (stamp, T_wo)))
    live = []
    with bench.recorder:
        for due, put, arguments in sorted(events, key=lambda event: event[0]):
            put(*arguments)
            bench.time.now = due / 1000
            estimate = bench.fusion.step()
            if estimate is not None and estimate.T_wo is not None:
                live.append(estimate)
    assert len(live) > 30
    assert sum(bench.streams.refused().values()) > 5  # the hard case did occur

    recording = read_recording(path)
    estimator = PoseEstimator(recording.hand, recording.object, EstimatorConfig.tuned())
    measurements = recording.measurements(rate="recorded")
    assert [m.time for m in measurements] == [estimate.time for estimate in live]
    for measurement, estimate in zip(measurements, live, strict=True):
        replayed = estimator.update(measurement)
        np.testing.assert_array_equal(replayed.T_wo.matrix(), estimate.T_wo.matrix())
        assert replayed.status == estimate.status
