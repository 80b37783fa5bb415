# SPDX-License-Identifier: MIT
"""Infrared images beside depth images: the one of the same instant goes to the tracker, and no other."""

from types import SimpleNamespace as Message

import gtsam
import numpy as np
import pytest

from vtgtsam import PoseEstimator, load_hand, load_object
from vtgtsam.live.fusion import Fusion
from vtgtsam.live.inputs import Inputs
from vtgtsam.live.recorder import Recorder
from vtgtsam.live.slots import PoseSlot
from vtgtsam.recording.topics import DepthTopic
from vtgtsam.ros.depth import DepthTracking
from vtgtsam.ros.infrared import InfraredImages, infrared_of
from vtgtsam.ros.intake import Stamps, Unusable
from vtgtsam.ros.publisher_clock import PublisherClock
from vtgtsam.vision.tracker import TrackedPose

MS = 1_000_000
WIDTH, HEIGHT = 6, 4


def stamped(stamp_ns, **fields):
    stamp = Message(sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    return Message(header=Message(stamp=stamp, frame_id=""), **fields)


def mono8(stamp_ns, image, padding=0):
    rows = np.pad(image, ((0, 0), (0, padding)))
    height, width = image.shape
    return stamped(
        stamp_ns, encoding="mono8", height=height, width=width, step=width + padding, data=rows.tobytes()
    )  # fmt: skip


def picture(value):
    return np.full((HEIGHT, WIDTH), value, dtype=np.uint8)


def images():
    return InfraredImages("/infra1", Stamps(PublisherClock(lambda: 0)))


def test_an_image_with_padded_rows_is_read():
    image = np.arange(HEIGHT * WIDTH, dtype=np.uint8).reshape(HEIGHT, WIDTH)
    np.testing.assert_array_equal(infrared_of(mono8(1, image, padding=2)), image)


@pytest.mark.parametrize("change", [{"encoding": "rgb8"}, {"width": 9}, {"data": b"short"}])
def test_an_image_that_is_none_is_refused_in_words(change):
    message = mono8(1, picture(3))
    message.__dict__.update(change)
    with pytest.raises(Unusable, match="has "):
        infrared_of(message)


def test_the_image_of_the_same_instant_is_found_and_another_is_not():
    kept = images()
    for n in (1, 2, 3):
        kept.intake(mono8(n * MS, picture(10 * n)))
    assert (kept.at(2 * MS) == 20).all()
    assert kept.intake.unusable == 0
    assert kept.at(2 * MS + 1) is None
    assert kept.intake.unusable == 1 and "stamp" in kept.intake.why


class Spy:
    def __init__(self):
        self.infrared = []

    def update(self, depth, T_wc, joints, T_wh, infrared=None):
        self.infrared.append(infrared)
        return TrackedPose.lost()


def test_it_goes_to_the_tracker_with_the_depth_measured_from_it():
    hand, obj = load_hand("isyhand"), load_object("can")
    inputs = Inputs(
        hand.joint_names, hand.pad_names, lambda: 9 * MS, Recorder(None), hand_moves=True
    )
    camera, clock = PoseSlot(), PublisherClock(lambda: 9 * MS)
    fusion = Fusion(inputs, PoseEstimator(hand, obj), lambda: 9 * MS)
    entry = DepthTopic(topic="/d", info="/i", infrared="/infra1")
    tracking = DepthTracking(entry, hand, obj, inputs, camera, fusion, clock)
    inputs.put_hand_pose(1, gtsam.Pose3())
    inputs.put_joints(9 * MS, hand.joint_names, np.zeros(len(hand.joint_names)).tolist())
    camera.put(1, gtsam.Pose3())
    tracking.info(Message(width=WIDTH, height=HEIGHT, k=[9.0, 0, 3.0, 0, 9.0, 2.0, 0, 0, 1]))
    spy = Spy()
    tracking._tracker, tracking._tracks = spy, True
    depth = np.full((HEIGHT, WIDTH), 0.5, dtype=np.float32)
    message = stamped(
        9 * MS, encoding="32FC1", height=HEIGHT, width=WIDTH, is_bigendian=0, step=4 * WIDTH, data=depth.tobytes()
    )  # fmt: skip
    tracking.infrared.intake(mono8(9 * MS, picture(70)))
    tracking.look(9 * MS, message)
    tracking.infrared.intake(mono8(9 * MS, picture(70)[:, 1:]))  # another size
    tracking.look(9 * MS, message)
    assert (spy.infrared[0] == 70).all() and spy.infrared[1] is None
    assert "has size" in tracking.infrared.intake.why
