# SPDX-License-Identifier: MIT
"""Our own tracker on messages with depth images: it finds the object in the open hand, and follows it."""

from __future__ import annotations

from types import SimpleNamespace as Message

import gtsam
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sim.camera import D435, DepthCamera, add_depth_noise
from sim.hands import load_description
from sim.observe import camera_pose, window
from sim.placement import above_palm
from sim.replay import Replay
from sim.world import World
from vtgtsam import PoseEstimator, adds, load_object
from vtgtsam.live.fusion import Fusion
from vtgtsam.live.inputs import Inputs
from vtgtsam.live.recorder import Recorder
from vtgtsam.live.slots import PoseSlot
from vtgtsam.recording.images import encode_depth
from vtgtsam.recording.topics import DepthTopic
from vtgtsam.ros.depth import DepthTracking, depth_of, intrinsics_of
from vtgtsam.ros.intake import Unusable
from vtgtsam.ros.publisher_clock import PublisherClock
from vtgtsam.vision.in_hand import IMAGES

MS = 1_000_000


def raw(depth, encoding="16UC1"):
    scale, kind = (1000, np.uint16) if encoding == "16UC1" else (1, np.float32)
    pixels = np.rint(depth * scale) if scale == 1000 else depth
    data = pixels.astype(kind)
    height, width = depth.shape
    return Message(
        encoding=encoding, height=height, width=width, is_bigendian=0,
        step=width * data.itemsize, data=data.tobytes(),
    )  # fmt: skip


@pytest.mark.parametrize("encoding", ["16UC1", "32FC1", "png", "compressedDepth"])
def test_images_of_each_kind_are_metres(encoding):
    depth = np.array([[0.5, 0.0, 1.234], [0.25, 2.0, 0.75]])
    if encoding in ("16UC1", "32FC1"):
        message = raw(depth, encoding)
    else:
        head = b"\0" * 12 if encoding == "compressedDepth" else b""
        message = Message(format=f"16UC1; {encoding}", data=head + encode_depth(depth))
    np.testing.assert_allclose(depth_of(message), depth, atol=1e-6)


@pytest.mark.parametrize(
    "change", [{"encoding": "rgb8"}, {"width": 4}, {"data": b"short"}, {"step": 0}]
)
def test_an_image_that_is_none_is_refused_in_words(change):
    message = raw(np.ones((2, 3)))
    message.__dict__.update(change)
    with pytest.raises(Unusable, match="has "):
        depth_of(message)


def test_it_finds_the_object_in_the_open_hand_and_follows_it():
    description = load_description("isyhand")
    obj = load_object("mug")
    world = World(description, description.load_hand(), obj)
    world.refresh()
    T_wc, T_wh = camera_pose(world), gtsam.Pose3(world.T_wh())
    intrinsics = window(world, T_wc, D435.scaled(0.5))
    replay = Replay(world.model, world.hand.joint_names)
    lens = DepthCamera(world.model, intrinsics)
    start = above_palm(
        description, obj.mesh, Rotation.from_euler("xyz", [0.3, 0.2, 1.0]).as_matrix()
    )
    rng, now = np.random.default_rng(1), [0]
    inputs = Inputs(
        world.hand.joint_names,
        world.hand.pad_names,
        lambda: now[0],
        Recorder(None),
        hand_moves=True,
    )
    fusion = Fusion(inputs, PoseEstimator(world.hand, obj), lambda: now[0])
    camera = PoseSlot()
    tracking = DepthTracking(
        DepthTopic(topic="/d", info="/i"), world.hand, obj, inputs, camera, fusion,
        PublisherClock(lambda: now[0]),
    )  # fmt: skip
    inputs.put_hand_pose(1, T_wh)
    errors = []
    for k in range(1, 2 * IMAGES + 16):
        now[0] = 33 * MS * k
        T_wo = start @ np.array(
            gtsam.Pose3(gtsam.Rot3(), [0.0, 0.0, 0.001 * max(0, k - 2 * IMAGES - 2)]).matrix()
        )
        replay.show(world.start, world.T_wh(), T_wo)
        clean, _ = lens.render(replay.data, T_wc)
        inputs.put_joints(now[0], world.hand.joint_names, np.asarray(world.start).tolist())
        image = raw(add_depth_noise(clean, rng))
        tracking.look(now[0], image)
        if k == 1:
            assert "waiting for joints" in tracking.state
            camera.put(1, T_wc)
            i = intrinsics
            k_matrix = [i.fx, 0, i.cx, 0, i.fy, i.cy, 0, 0, 1]
            tracking.info(Message(width=i.width, height=i.height, k=k_matrix))
            assert intrinsics_of(Message(width=i.width, height=i.height, k=k_matrix)) == i
        for seen in inputs.vision.waiting(now[0]):
            inputs.vision.take(now[0])
            errors.append(adds(obj.mesh, seen.T_wo, gtsam.Pose3(T_wo)))
            assert seen.covariance is not None
    assert tracking.state == "follows the object"
    assert len(errors) >= 12 and max(errors[3:]) < 0.002
