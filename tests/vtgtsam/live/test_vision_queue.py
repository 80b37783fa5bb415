# SPDX-License-Identifier: MIT
from __future__ import annotations

import gtsam

from vtgtsam.live.vision import WAITING, VisionQueue, VisualPose


def pose(stamp):
    return VisualPose(stamp, gtsam.Pose3())


def taken(found):
    return None if found is None else found.stamp_ns


def test_each_frame_takes_one_in_the_order_in_which_they_came():
    queue = VisionQueue()
    queue.put(pose(30))
    queue.put(pose(20))
    assert [taken(queue.take(40)) for _ in range(3)] == [30, 20, None]


def test_a_pose_of_an_image_after_the_frame_waits():
    queue = VisionQueue()
    queue.put(pose(30))
    assert queue.take(29) is None
    assert taken(queue.take(30)) == 30


def test_an_image_counts_once_and_is_refused_when_it_comes_again():
    queue = VisionQueue()
    assert queue.put(pose(30))
    assert taken(queue.take(31)) == 30
    assert not queue.put(pose(30))
    assert queue.refused == 1
    assert queue.take(32) is None


def test_for_an_estimator_without_memory_a_pose_counts_for_a_while():
    queue = VisionQueue(hold_ns=10)
    queue.put(pose(30))
    assert [taken(queue.take(t)) for t in (31, 40, 41)] == [30, 30, None]


def test_a_tracker_that_is_faster_than_the_frames_loses_its_older_poses():
    queue = VisionQueue()
    for stamp in range(WAITING + 3):
        queue.put(pose(stamp))
    assert queue.passed_over == 3
    assert taken(queue.take(100)) == 3


def test_the_first_frame_takes_its_own_image_and_forgets_older_ones():
    queue = VisionQueue()
    queue.put(pose(10))
    queue.put(pose(20))
    assert queue.begin(15) is None
    assert taken(queue.begin(20)) == 20
    assert queue.take(100) is None
