# SPDX-License-Identifier: MIT
"""The object's first pose from a depth image of the open hand, rendered with the camera's noise."""

from __future__ import annotations

import time
from functools import cache
from types import SimpleNamespace

import gtsam
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hardware.camera.camera import CameraError, CameraFrame
from hardware.live.find import as_start, choose, still_image
from sim.camera import D435, DepthCamera, add_depth_noise
from sim.hands import load_description
from sim.observe import camera_pose, window
from sim.placement import above_palm
from sim.replay import Replay
from sim.world import World
from vtgtsam import adds, load_object
from vtgtsam.exceptions import LiveError
from vtgtsam.vision.alignment import Shape
from vtgtsam.vision.first_pose import Candidate, candidates
from vtgtsam.vision.in_hand import object_view


class Bench:
    """An open hand with one object, seen by a camera; a forearm stands in the image as well."""

    def __init__(self, name):
        description = load_description("isyhand")
        self.obj = load_object(name)
        self.world = World(description, description.load_hand(), self.obj)
        self.world.refresh()
        self.T_wc = camera_pose(self.world)
        self.camera = window(self.world, self.T_wc, D435.scaled(0.5))
        self.T_ch = self.T_wc.between(gtsam.Pose3(self.world.T_wh()))
        self.joints = self.world.start

    def image(self, T_wo, seed=0):
        """Median of ten noisy images, and the true T_co."""
        replay = Replay(self.world.model, self.world.hand.joint_names)
        replay.show(self.joints, self.world.T_wh(), T_wo)
        clean, _ = DepthCamera(self.world.model, self.camera).render(replay.data, self.T_wc)
        rng = np.random.default_rng(seed)
        images = [add_depth_noise(clean, rng) for _ in range(10)]
        return np.median(images, axis=0), self.T_wc.between(gtsam.Pose3(T_wo))

    def on_palm(self, R_wo):
        return above_palm(self.world.description, self.obj.mesh, R_wo.as_matrix())

    def view(self, depth):
        return object_view(depth, self.camera, self.obj, self.world.hand, self.joints, self.T_ch)

    def find(self, depth):
        found = candidates(Shape(self.obj.sdf), self.view(depth))
        return choose(found, self.obj, self.T_ch)


@cache
def on_bench(name):
    """One for all tests: none of them moves it."""
    return Bench(name)


@pytest.mark.parametrize(
    ("name", "angles"),
    [
        # Seconds of search each; on the emulated robot a run finds its object by the same search.
        pytest.param("can", (90, 0, 0), marks=pytest.mark.slow),
        pytest.param("bottle", (90, 0, 30), marks=pytest.mark.slow),
        pytest.param("drill", (90, 30, 0), marks=pytest.mark.slow),
    ],
)
def test_an_object_is_found_however_it_lies(name, angles):
    bench = on_bench(name)
    depth, T_co = bench.image(bench.on_palm(Rotation.from_euler("xyz", angles, degrees=True)))
    found = bench.find(depth)
    assert found.score > 0.9
    assert adds(bench.obj.mesh, found.T_co, T_co) < 0.001  # [m], of noise of 4 mm


def test_an_empty_hand_is_not_taken_for_an_object():
    bench = on_bench("mug")
    T_away = np.eye(4)
    T_away[2, 3] = -5.0
    depth, _ = bench.image(T_away)
    view = bench.view(depth)
    found = [] if view is None else candidates(Shape(bench.obj.sdf), view)
    with pytest.raises(LiveError, match=r"mug was not found in the hand.*--start"):
        choose(found, bench.obj, bench.T_ch)


def test_another_object_is_not_taken_for_this_one():
    bench, other = on_bench("mug"), on_bench("can")
    depth, _ = other.image(other.on_palm(Rotation.from_euler("x", 90, degrees=True)))
    with pytest.raises(LiveError, match="mug was not found"):
        bench.find(depth)


def test_of_two_poses_that_fit_equally_well_a_person_has_to_choose():
    bench = on_bench("mug")
    T_co = bench.T_ch * gtsam.Pose3(gtsam.Rot3(), np.array([0.09, 0.05, 0.1]))
    turned = T_co * gtsam.Pose3(gtsam.Rot3.Rz(2.0), np.zeros(3))
    first, second = Candidate(T_co, 0.95, 0.0), Candidate(turned, 0.94, 0.0)
    with pytest.raises(LiveError, match=r"fits two poses of mug") as caught:
        choose([first, second], bench.obj, bench.T_ch)
    assert as_start(first, bench.T_ch) == "0.0900,0.0500,0.1000,0.0000,0.0000,0.0000,1.0000"
    assert as_start(second, bench.T_ch) in str(caught.value)
    assert (
        choose(
            [first, Candidate(turned, 0.9, 0.0), Candidate(turned, 0.94, 0.2)],
            bench.obj,
            bench.T_ch,
        )
        is first
    )


def test_poses_that_differ_by_the_objects_symmetry_are_one():
    bench = on_bench("can")
    spun = bench.T_ch * gtsam.Pose3(gtsam.Rot3.Rz(1.0), np.zeros(3))
    first = Candidate(bench.T_ch, 0.95, 0.0)
    assert choose([first, Candidate(spun, 0.95, 0.0)], bench.obj, bench.T_ch) is first


def test_images_that_are_always_too_old_are_an_error_with_the_cause():
    frame = CameraFrame(time.monotonic() - 5.0, np.zeros((2, 2)), None)
    camera = SimpleNamespace(name="D435", read=lambda: frame)
    with pytest.raises(CameraError, match=r"stamps of D435 are from 5\.\d s ago: did a clock jump"):
        still_image(camera)
