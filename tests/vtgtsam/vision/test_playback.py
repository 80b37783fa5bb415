# SPDX-License-Identifier: MIT
"""Poses from files in the place of a tracker."""

import gtsam
import numpy as np

from vtgtsam.recording.pose_files import PoseFiles
from vtgtsam.vision.playback import Playback
from vtgtsam.vision.tracker import VisualTracker

POSES = [gtsam.Pose3(gtsam.Rot3.RzRyRx(0.3 * k, -0.2, 0.9), [0.1 * k, -0.2, 0.7]) for k in range(4)]
TIMES = [1.0 + 0.033 * k for k in range(4)]


def foundation_pose(folder, poses, names):
    folder.mkdir()
    for name, pose in zip(names, poses, strict=True):
        np.savetxt(folder / f"{name}.txt", pose.matrix())
    return folder


def tum(path):
    with path.open("w") as file:
        for time, pose in zip(TIMES, POSES, strict=True):
            print(time, *pose.translation(), *pose.rotation().toQuaternion().coeffs(), file=file)
    return path


def assert_same(found, expected):
    for a, b in zip(found, expected, strict=True):
        assert (a is None) == (b is None)
        assert a is None or a.equals(b, 1e-8)


def test_played_back_they_are_a_tracker(tmp_path):
    names = ("0000000", "0000001", "0000003")
    files = PoseFiles.read(foundation_pose(tmp_path / "x", [POSES[k] for k in (0, 1, 3)], names))
    tracker = Playback.of_files(files, TIMES)
    assert isinstance(tracker, VisualTracker)
    T_wc = gtsam.Pose3(gtsam.Rot3.Rx(2.0), [1.0, 0.0, 0.5])
    image = np.zeros((2, 2))
    for _ in range(2):
        tracker.start(gtsam.Pose3())
        tracked = [tracker.update(image, T_wc) for _ in range(5)]
        assert [t.status for t in tracked] == ["ok", "ok", "lost", "ok", "lost"]
        assert_same([t.T_wo for t in tracked[:2]], [T_wc * POSES[0], T_wc * POSES[1]])
    stamped = Playback.of_files(PoseFiles.read(tum(tmp_path / "x.txt")), TIMES[2:])
    assert_same([stamped.update(image, T_wc).T_wo for _ in range(3)], [*POSES[2:], None])
