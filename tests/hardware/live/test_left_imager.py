# SPDX-License-Identifier: MIT
"""A stereo camera's left imager in the live loop: its depth and infrared image go to the tracker, from its place."""

from __future__ import annotations

from types import SimpleNamespace

import gtsam
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hardware.camera.camera import CameraFrame
from hardware.camera.imager import LeftImager, LeftImages
from hardware.live.recording import open_recording
from hardware.live.sensors import Vision
from hardware.live.tracking import run_tracker
from sim.camera import MAX_RANGE
from sim.hands import load_description
from sim.observe import camera_pose, window
from sim.placement import above_palm
from sim.replay import Replay
from sim.stereo import rig
from sim.stereo.infrared import InfraredCamera
from sim.stereo.matching import Matcher, depth_of
from sim.stereo.video import exposed, surrounding
from sim.world import World
from vtgtsam import EstimatorConfig, adds, load_object, read_recording
from vtgtsam.camera import CameraIntrinsics
from vtgtsam.live.clock import RunClock
from vtgtsam.live.inputs import Inputs
from vtgtsam.live.recorder import Recorder
from vtgtsam.recording import RecordingWriter
from vtgtsam.recording.camera import color_images, depth_images

COLOR = CameraIntrinsics(32, 24, 40.0, 40.0, 15.5, 11.5)
# The colour camera is 15 mm to the right of the left imager, and turned: more than a real one, so that it shows.
T_CD = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.03, -0.05, 0.04), np.array([-0.015, 0.001, 0.002]))
COUNT = 3


class Scene:
    """The open hand with a mug on it, as a stereo camera sees it; the world is its colour camera's frame."""

    def __init__(self):
        description = load_description("isyhand")
        self.obj = load_object("mug")
        world = World(description, description.load_hand(), self.obj)
        world.refresh()
        self.hand, self.joints = world.hand, world.start
        T_vd = camera_pose(world)  # v: the simulated world
        lying = Rotation.from_euler("xyz", (90, 0, 30), degrees=True).as_matrix()
        T_vo = above_palm(description, self.obj.mesh, lying)
        replay = Replay(world.model, self.hand.joint_names)
        replay.show(self.joints, world.T_wh(), T_vo)
        self.intrinsics = window(world, T_vd, rig.INFRARED)
        part, self._inner = surrounding(self.intrinsics)
        places = (0.0, rig.BASELINE)
        self._pair = np.stack(
            [InfraredCamera(world.model, part, x).render(replay.data, T_vd) for x in places]
        )
        self.T_ch = T_CD * T_vd.between(gtsam.Pose3(world.T_wh()))
        self.T_co = T_CD * T_vd.between(gtsam.Pose3(T_vo))

    def images(self, seed, infrared=True):
        """What the left imager measures in one instant."""
        left, right = exposed(self._pair, np.random.default_rng(seed), 1.0)
        disparity = Matcher().disparity(left, right)[self._inner]
        depth = depth_of(disparity, self.intrinsics.fx, MAX_RANGE)
        return LeftImages(depth.astype(np.float32), left[self._inner] if infrared else None)


@pytest.fixture(scope="module")
def scene():
    return Scene()


def emulated(scene, images, left=None):
    """A camera with frames 10 ms apart; its aligned images are not the left imager's in size or content."""
    colors = np.full((COLOR.height, COLOR.width, 3), 90, dtype=np.uint8)
    aligned = np.full((COLOR.height, COLOR.width), 0.7, dtype=np.float32)
    frames = iter([CameraFrame(k / 100, aligned, colors, seen) for k, seen in enumerate(images)])
    return SimpleNamespace(
        name="stereo", intrinsics=COLOR, left=left, read=lambda: next(frames, None)
    )


def plan(scene, tracker, record=None):
    config = EstimatorConfig()
    return SimpleNamespace(
        tracker=tracker, obj=scene.obj, hand=scene.hand, record=record, config=config, calibration=None
    )  # fmt: skip


def watch(scene, images, recorder=None, T_cd=T_CD):
    """Poses in the world that the vision thread finds, from a start 3 mm and 3 degrees beside; and the thread."""
    camera = emulated(scene, images, LeftImager(scene.intrinsics, T_cd))
    tracker, imager = run_tracker(plan(scene, "depth-hand"), camera)
    off = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.03, -0.02, 0.03), np.array([0.002, -0.002, 0.002]))
    tracker.start(scene.T_co * off)
    now = [0.0]
    clock = RunClock(lambda: now[0])
    now[0] = 0.5
    recorder = recorder or Recorder(None)
    inputs = Inputs(scene.hand.joint_names, scene.hand.pad_names, lambda: 0, recorder)
    inputs.put_joints(0, scene.hand.joint_names, scene.joints.tolist())
    poses = []
    inputs.put_vision = lambda instant_ns, T_wo, *beside: poses.append(T_wo)
    vision = Vision(camera, tracker, scene.T_ch, inputs, clock, images=True, imager=imager)
    vision.run(SimpleNamespace(is_set=lambda: False))
    return poses, vision


def test_the_pose_comes_out_in_the_colour_cameras_frame(scene):
    poses, vision = watch(scene, [scene.images(k) for k in range(COUNT)])
    assert len(poses) == COUNT and vision.remarks() == []
    for T_wo in poses:
        # Depth alone leaves 0.65 mm here; with the imager in a wrong place it stays 1.6 mm off, as it started.
        assert adds(scene.obj.mesh, T_wo, scene.T_co) < 0.0005


def test_where_no_infrared_image_came_the_left_imagers_depth_goes_on_alone(scene):
    poses, vision = watch(scene, [scene.images(k, infrared=k == 1) for k in range(COUNT)])
    assert len(poses) == COUNT
    assert adds(scene.obj.mesh, poses[0], scene.T_co) < 0.0015
    assert vision.without_infrared == 2
    (remark,) = vision.remarks()
    assert remark.startswith("2 images came without the infrared image of their instant")


def test_what_is_recorded_stays_the_aligned_depth_and_colour(scene, tmp_path):
    with Recorder(RecordingWriter(tmp_path / "out.mcap")) as recorder:
        watch(scene, [scene.images(k) for k in range(COUNT)], recorder)
    depths = [image for _, image in depth_images(tmp_path / "out.mcap")]
    colors = [image for _, image in color_images(tmp_path / "out.mcap")]
    assert len(depths) == len(colors) == COUNT
    assert depths[0].shape == colors[0].shape[:2] == (COLOR.height, COLOR.width)
    np.testing.assert_allclose(depths[0], 0.7, atol=1e-4)


@pytest.mark.parametrize("name", ["depth-hand", "depth-hand+back"])
def test_a_tracker_that_knows_the_hand_is_given_the_left_imagers_images(scene, name):
    left = LeftImager(scene.intrinsics, T_CD)
    tracker, imager = run_tracker(plan(scene, name), emulated(scene, [], left))
    assert imager is left and tracker.camera == scene.intrinsics


@pytest.mark.parametrize(("name", "has"), [("depth", True), ("depth+back", True), ("depth-hand", False)])  # fmt: skip
def test_other_trackers_and_other_cameras_go_on_with_aligned_depth(scene, name, has):
    left = LeftImager(scene.intrinsics, T_CD) if has else None
    tracker, imager = run_tracker(plan(scene, name), emulated(scene, [], left))
    assert imager is None and tracker.camera == COLOR


@pytest.mark.parametrize("infrared", [True, False])
def test_the_recording_says_whether_the_tracker_was_given_infrared_images(
    scene, tmp_path, infrared
):
    path = tmp_path / "run.mcap"
    started = "2026-01-01T00:00:00+00:00"
    with open_recording(
        plan(scene, "depth-hand", path), "D435", started, 0.2, False, infrared
    ) as writer:
        writer.camera_pose(0.0, gtsam.Pose3())
    assert read_recording(path).info.get("infrared") == ("yes" if infrared else None)
