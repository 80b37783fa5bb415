# SPDX-License-Identifier: MIT
from __future__ import annotations

import gtsam
import numpy as np
import pytest

from vtgtsam import load_hand, read_recording
from vtgtsam.exceptions import RecordingError
from vtgtsam.recording import RecordingWriter


def _with_one_visual_pose(path, metadata):
    hand = load_hand("isyhand")
    with RecordingWriter(path, {"hand": "isyhand", **metadata}) as writer:
        for time in (0.0, 0.3, 0.6):
            writer.joint_states(time, hand.joint_names, np.zeros(len(hand.joint_names)))
            writer.tactile(time, hand.pad_names, np.zeros(len(hand)), np.zeros(len(hand)))
            writer.estimate(time, gtsam.Pose3())
        writer.object_pose(0.0, gtsam.Pose3())
    return read_recording(path)


@pytest.mark.parametrize(
    ("metadata", "seen"),
    [({}, [True, False, False]), ({"vision_hold": "0.3"}, [True, True, False])],
)
def test_a_visual_pose_counts_for_as_long_as_the_live_run_let_it(tmp_path, metadata, seen):
    recording = _with_one_visual_pose(tmp_path / "run.mcap", metadata)
    frames = recording.measurements(rate="recorded")
    assert [frame.T_wo_visual is not None for frame in frames] == seen


def test_a_vision_hold_that_is_no_duration_is_refused(tmp_path):
    recording = _with_one_visual_pose(tmp_path / "run.mcap", {"vision_hold": "long"})
    with pytest.raises(RecordingError, match="vision_hold must be seconds, got 'long'"):
        recording.measurements(rate="recorded")
