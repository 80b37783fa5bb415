# SPDX-License-Identifier: MIT
"""Grasps of which fewer keyframes are kept."""

from gripped_boxes import write_grip

from vtgtsam import PoseEstimator, read_recording
from vtgtsam.calibration.keyframes import grasp, thinned


def test_of_a_thinned_grasp_every_other_keyframe_is_kept_and_lies_twice_as_far_apart(tmp_path):
    recording = read_recording(write_grip(tmp_path / "a.mcap", frames=60))
    estimator = PoseEstimator(recording.hand, recording.object)
    whole = grasp("g", estimator, recording.measurements())
    half = thinned(whole, 2)
    assert len(whole.keyframes) > 4
    assert half.keyframes == whole.keyframes[::2]
    assert half.spacing == 2 * whole.spacing
    assert half.seen == whole.seen
