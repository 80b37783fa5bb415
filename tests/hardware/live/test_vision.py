# SPDX-License-Identifier: MIT
from __future__ import annotations

from types import SimpleNamespace

import gtsam
import numpy as np

from hardware.camera.camera import CameraFrame
from hardware.live.fusion import STREAMS
from hardware.live.recorder import Recorder
from hardware.live.sensors import Vision
from hardware.live.streams import RunClock, Streams

POSE = gtsam.Pose3(gtsam.Rot3(), np.array([0.0, 0.0, 0.5]))


class Tracker:
    """Sees the object except in some of the images it is given; remembers the joints."""

    def __init__(self, blind=()):
        self.blind, self.asked, self.joints = blind, [], []

    def update(self, depth, T_wc, joints, T_wh):
        self.asked.append(int(depth[0, 0]))
        self.joints.append(joints)
        return SimpleNamespace(T_wo=None if self.asked[-1] in self.blind else POSE)


def watch(tracker, count, joints_at=(0,)):
    """The streams after images at 0, 10, 20, ... ms, whose first pixel is their number."""
    streams = Streams(STREAMS)
    for ms in joints_at:
        streams.put("joints", ms * 1_000_000, np.array([ms]))
    frames = iter([CameraFrame(k / 100, np.full((2, 2), k), None) for k in range(count)])
    camera = SimpleNamespace(name="film", read=lambda: next(frames, None))
    now = [0.0]
    clock = RunClock(lambda: now[0])
    now[0] = 0.5
    vision = Vision(camera, tracker, gtsam.Pose3(), streams, clock, Recorder(None), images=True)
    vision.run(SimpleNamespace(is_set=lambda: False))
    return streams, vision


def test_each_image_is_tracked_with_the_joints_of_its_instant():
    tracker = Tracker()
    streams, vision = watch(tracker, 4, joints_at=(0, 15))
    assert tracker.asked == [0, 1, 2, 3]
    assert [int(q[0]) for q in tracker.joints] == [0, 0, 15, 15]
    assert streams.count("vision") == streams.count("images") == 4
    assert vision.lost == 0


def test_a_lost_object_is_looked_for_in_every_other_image_until_it_is_found():
    tracker = Tracker(blind={2, 4, 6})
    streams, vision = watch(tracker, 12)
    assert tracker.asked == [0, 1, 2, 4, 6, 8, 9, 10, 11]
    assert streams.count("images") == 12  # the estimator waits for none of them
    assert streams.count("vision") == 6
    assert vision.lost == 6
