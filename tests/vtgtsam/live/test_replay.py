# SPDX-License-Identifier: MIT
"""A run that calibrates its robot, and its recording played once more."""

import numpy as np
import pytest
from gripped_boxes import JOINTS, PADS, drawn, write_grip

from vtgtsam import Calibration, EstimatorConfig, read_recording
from vtgtsam.calibration.online import OnlineCalibration
from vtgtsam.calibration.robot import Robot
from vtgtsam.exceptions import RecordingError
from vtgtsam.live.fusion import Fusion
from vtgtsam.live.inputs import Inputs
from vtgtsam.live.recorder import Recorder
from vtgtsam.live.replay import replay
from vtgtsam.offsets import CalibrationPrior
from vtgtsam.recording import RecordingWriter, names
from vtgtsam.recording.provenance import mesh_file, object_metadata


def known_before(hand):
    """A calibration that knows little."""
    P = CalibrationPrior.of_config(EstimatorConfig(), hand.zero_units, np.zeros(3)).covariance
    zeros = dict(zip(JOINTS, np.full(4, 1e-3), strict=True))
    return Calibration(Robot.of_hand(hand), np.full(6, 1e-3), np.zeros(3), zeros, P / 2)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The path of a run's recording, and what it estimated."""
    folder = tmp_path_factory.mktemp("run")
    grip = read_recording(write_grip(folder / "grip.mcap", drawn(4), seed=2, frames=120))
    hand, obj, now = grip.hand, grip.object, [0]
    prior = known_before(hand)
    metadata = {**object_metadata(obj), "hand": hand.name, names.VISION_HOLD: "0.0"}
    writer = RecordingWriter(
        folder / "run.mcap",
        metadata,
        hand_xml=hand.xml,
        mesh=mesh_file(obj),
        calibration=prior,
    )
    estimates = []
    with Recorder(writer) as recorder:

        def changed(time, calibration):
            recorder.write("calibration", round(time * 1e9), calibration)

        inputs = Inputs(
            hand.joint_names, hand.pad_names, lambda: now[0], recorder, hold_ns=0, hand_moves=True
        )
        online = OnlineCalibration(hand, obj, prior=prior, background=False, on_change=changed)
        fusion = Fusion(inputs, online, lambda: now[0], steady=lambda: now[0])
        late = []
        for frame in grip.measurements():
            stamp_ns = round(frame.time * 1e9)
            now[0] = stamp_ns + 2_000_000
            inputs.put_hand_pose(stamp_ns, frame.T_wh)
            inputs.put_contacts(stamp_ns, PADS, frame.contacts.tolist())
            inputs.put_joints(stamp_ns, JOINTS, frame.joints.tolist())
            late.append((stamp_ns, frame))
            if len(late) > 2:
                seen_ns, seen = late.pop(0)
                alike = 1.0 + seen.time % 1.0  # [s]
                inputs.put_vision(seen_ns, seen.T_wo_visual, seen.visual_covariance, alike)
            if (estimate := fusion.step()) is not None:
                estimates.append(estimate)
    assert online.calibration is not prior
    return folder / "run.mcap", estimates


def test_a_replay_gives_the_same_poses_to_the_last_bit(run):
    path, estimates = run
    again = replay(read_recording(path))
    assert len(again) == len(estimates) > 100
    assert read_recording(path).streams.vision.correlation(50) > 1.0
    for now, then in zip(again, estimates, strict=True):
        np.testing.assert_array_equal(now.T_wo.matrix(), then.T_wo.matrix())
        np.testing.assert_array_equal(now.covariance, then.covariance)


def test_the_recording_has_the_calibrations_and_stays_uncorrected(run):
    recording = read_recording(run[0])
    first, changes = recording.calibrations
    assert first.joint_zeros["j_xp"] == 1e-3
    assert [round(at, 1) for at, _ in changes] == [2.0, 3.0, 4.0]
    assert changes[-1][1].covariance[6, 6] < first.covariance[6, 6]
    raw = recording.streams.joints.columns["j_xp"][1]
    assert len(set(raw.tolist())) == 1  # as measured


def test_a_recording_without_has_none(tmp_path):
    recording = read_recording(write_grip(tmp_path / "a.mcap", frames=10))
    assert recording.calibrations == (None, ())


def test_a_calibration_that_cannot_be_read_is_said_when_it_is_wanted(tmp_path):
    class Broken:
        def text(self):
            return "hand: [gripper"

    path = tmp_path / "a.mcap"
    with RecordingWriter(path, {}) as writer:
        writer.joint_states(1.0, ["a"], [0.0])
        writer.calibration(1.0, Broken())
    recording = read_recording(path)
    with pytest.raises(RecordingError, match="calibration in the recording"):
        recording.calibrations  # noqa: B018
