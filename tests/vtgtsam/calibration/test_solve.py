# SPDX-License-Identifier: MIT
"""Where the solver starts, and which of several minima it takes."""

import numpy as np
from gripped_boxes import drawn, write_grip

from vtgtsam import EstimatorConfig, PoseEstimator, read_recording
from vtgtsam.calibration.keyframes import grasp
from vtgtsam.calibration.posterior import Known
from vtgtsam.calibration.robot import Robot
from vtgtsam.calibration.solve import solve

FAR = np.repeat([0.0, 3.0, 0.0], [3, 3, 4])  # a camera from which two steps do not lead back


def test_of_several_starts_the_one_that_ends_lowest_is_taken(tmp_path):
    recording = read_recording(write_grip(tmp_path / "a.mcap", drawn(4), frames=45))
    hand, frames, config = recording.hand, recording.measurements(), EstimatorConfig()
    known = Known.before(Robot.of(recording), hand, frames[0], None, config)
    one = grasp("g", PoseEstimator(hand, recording.object), frames)

    def mean_from(start):
        origin = known.camera_origin
        return solve([one], known.belief, start, origin, config, settled=np.inf).belief.mean

    near, far = known.belief.mean, known.belief.mean + FAR
    assert np.abs(mean_from(near) - mean_from(far)).max() > 1e-3
    for starts in ([near, far], [far, near]):
        np.testing.assert_array_equal(mean_from(np.array(starts)), mean_from(near))
