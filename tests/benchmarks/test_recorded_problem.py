# SPDX-License-Identifier: MIT
import gtsam
import numpy as np
from sequences import JOINTS, PADS, gripper, pose

from benchmarks.recorded import as_problem
from vtgtsam import load_object
from vtgtsam.recording import RecordingWriter
from vtgtsam.recording.provenance import mesh_file, object_metadata


def write(path):
    """A second of joints, contacts and vision at 100 Hz, of which the truth is known from 0.5 s on."""
    can = load_object("can", resolution=32)
    with RecordingWriter(
        path, object_metadata(can), hand_xml=gripper().xml, mesh=mesh_file(can)
    ) as writer:
        for k in range(100):
            t = 0.01 * k
            writer.joint_states(t, JOINTS, [t, -t])
            writer.tactile(t, PADS, [0.0, 0.5], [False, True])
            writer.hand_pose(t, pose(0.2))
            writer.object_pose(t, pose(t))
            if k >= 50:
                writer.truth(t, pose(t + 0.1))
    return path


def test_a_recordings_frames_are_those_whose_truth_is_known(tmp_path):
    problem = as_problem(write(tmp_path / "can_0.mcap"))
    assert problem.frames == 50
    np.testing.assert_allclose(problem.T_visual[0], pose(0.5).matrix(), atol=1e-12)
    np.testing.assert_allclose(problem.T_true[0], pose(0.6).matrix(), atol=1e-12)
    assert problem.contacts.tolist() == [[False, True]] * 50
    # Pads lie at the joints' axes and only turn with them.
    left = pose(0.2).rotation().compose(gtsam.Rot3.Rz(0.5))
    np.testing.assert_allclose(problem.T_wp[0, 0, :3, :3], left.matrix(), atol=1e-9)
