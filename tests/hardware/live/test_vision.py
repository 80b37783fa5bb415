# SPDX-License-Identifier: MIT
from __future__ import annotations

import threading
from types import SimpleNamespace

import gtsam
import numpy as np

from hardware.camera.camera import CameraError, CameraFrame
from hardware.live.sensors import Vision
from vtgtsam.live.clock import RunClock
from vtgtsam.live.inputs import Inputs
from vtgtsam.live.recorder import Recorder
from vtgtsam.vision.tracker import TrackedPose

POSE = gtsam.Pose3(gtsam.Rot3(), np.array([0.0, 0.0, 0.5]))
COVARIANCE = np.diag([4e-4, 4e-4, 1e-2, 1e-6, 1e-6, 4e-6])


class Tracker:
    """Sees the object except in some of the images it is given; remembers the joints."""

    def __init__(self, blind=()):
        self.blind, self.asked, self.joints = blind, [], []

    def update(self, depth, T_wc, joints, T_wh):
        self.asked.append(int(depth[0, 0]))
        self.joints.append(joints)
        if self.asked[-1] in self.blind:
            return TrackedPose.lost()
        return TrackedPose(POSE, COVARIANCE, 1.0, "ok", correlation=0.7)


def watch(tracker, count, joints_at=(0,), **given):
    """The streams after images at 0, 10, 20, ... ms, whose first pixel is their number."""
    inputs = Inputs(("joint",), ("pad",), lambda: 0, Recorder(None))
    for ms in joints_at:
        inputs.put_joints(ms * 1_000_000, ("joint",), [ms])
    frames = iter([CameraFrame(k / 100, np.full((2, 2), k), None) for k in range(count)])
    camera = SimpleNamespace(name="film", read=lambda: next(frames, None))
    now = [0.0]
    clock = RunClock(lambda: now[0])
    now[0] = 0.5
    vision = Vision(camera, tracker, gtsam.Pose3(), inputs, clock, images=True, **given)
    vision.run(SimpleNamespace(is_set=lambda: False))
    return inputs, vision


def test_each_image_is_tracked_with_the_joints_of_its_instant():
    tracker = Tracker()
    inputs, vision = watch(tracker, 4, joints_at=(0, 15))
    assert tracker.asked == [0, 1, 2, 3]
    assert [int(q[0]) for q in tracker.joints] == [0, 0, 15, 15]
    assert inputs.count("vision") == vision.images == 4
    assert vision.lost == 0


def test_what_the_tracker_says_of_its_pose_goes_with_it():
    inputs, _ = watch(Tracker(), 1)
    (pose,) = inputs.vision.waiting(10**9)
    np.testing.assert_allclose(pose.covariance, COVARIANCE, rtol=1e-9)
    assert pose.correlation == 0.7


def test_a_tracker_is_told_where_to_look_by_whether_it_saw_the_object_last():
    tracker, asked = Tracker(blind={1}), []
    tracker.told = []
    tracker.search_at = tracker.told.append

    def hint(seen):
        asked.append(seen)
        return None if seen else POSE

    watch(tracker, 6, hint=hint)
    assert tracker.asked == [0, 1, 3, 4, 5]  # it rests in image 2
    assert asked == [True, True, False, True, True]
    assert tracker.told == [POSE]


def test_a_lost_object_is_looked_for_in_every_other_image_until_it_is_found():
    tracker = Tracker(blind={2, 4, 6})
    inputs, vision = watch(tracker, 12)
    assert tracker.asked == [0, 1, 2, 4, 6, 8, 9, 10, 11]
    assert vision.images == 12  # the estimator waits for none of them
    assert inputs.count("vision") == 6
    assert vision.lost == 6


def test_a_camera_that_comes_back_counts_again():
    inputs = Inputs(("joint",), ("pad",), lambda: 0, Recorder(None))
    inputs.put_joints(0, ("joint",), [0.0])
    now, stop = [0.0], threading.Event()
    frames = iter(
        [CameraFrame(0.0, np.zeros((2, 2)), None), *[CameraError("unplugged")] * 3]
        + [CameraFrame(0.7, np.ones((2, 2)), None)]
    )

    def read():
        found = next(frames, None)
        now[0] += 0.2
        if isinstance(found, CameraError):
            raise found
        return found

    camera = SimpleNamespace(name="D435", read=read)
    vision = Vision(
        camera,
        Tracker(),
        gtsam.Pose3(),
        inputs,
        RunClock(lambda: now[0]),
        images=False,
    )
    vision.run(stop)
    assert vision.images == 2
    assert 0.5 < vision.silent < 1.0
    assert vision.trouble == "D435 has ended"
    assert vision.remarks()[0].startswith("no images for ")


def test_an_image_with_a_stamp_that_cannot_be_right_is_left_out_and_told():
    inputs = Inputs(("joint",), ("pad",), lambda: 0, Recorder(None))
    inputs.put_joints(0, ("joint",), [0.0])
    now = [10.0]
    clock = RunClock(lambda: now[0])
    now[0] = 20.0
    frames = iter([CameraFrame(t, np.zeros((2, 2)), None) for t in (15.0, 21.0, 19.9)])
    camera = SimpleNamespace(name="D435", read=lambda: next(frames, None))
    vision = Vision(camera, Tracker(), gtsam.Pose3(), inputs, clock, images=False)
    vision.run(threading.Event())
    assert vision.odd_stamps == 2
    assert vision.images == 1
    assert any(
        "2 images left out: by their stamps they are from 1.0 s ahead" in r
        for r in vision.remarks()
    )
