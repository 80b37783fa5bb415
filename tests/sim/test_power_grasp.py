# SPDX-License-Identifier: MIT
import numpy as np
import pytest
import trimesh

from sim import placement, power_grasp
from sim.hands import load_description
from sim.sampling import NotGraspable, sample_sequence
from sim.world import World
from vtgtsam import ObjectModel, build_sdf


@pytest.fixture
def world(tmp_path, monkeypatch):
    monkeypatch.setenv("VTGTSAM_CACHE", str(tmp_path))
    monkeypatch.setattr(power_grasp, "YAWS", np.array([0.0, np.pi / 2]))  # 12 instead of 24 tries
    mesh = trimesh.creation.cylinder(radius=0.025, height=0.11)
    description = load_description()
    obj = ObjectModel("rod", build_sdf(mesh, 16), mesh)
    return World(description, description.load_hand(), obj)


@pytest.mark.slow
def test_a_rod_is_laid_across_the_fingers_and_grasped_from_there(world):
    rest = power_grasp.power_grasp(world)
    assert abs(rest[1, 2]) > 0.95  # its axis lies across the palm, where three fingers reach it
    trajectories = []
    for seed in range(3):
        sample = sample_sequence(world, "occ", np.random.default_rng(seed))
        assert len(sample.rejections) <= 2
        trajectories.append(sample.trajectory)
    starts = np.array([trajectory.T_wo[0] for trajectory in trajectories])
    assert np.ptp(starts[:, :3, 3], axis=0).max() < 0.01  # the same grasp, but for small turns
    assert np.ptp(starts[:, 0, 2]) > 1e-4
    assert min(t.contacts[-1].sum() for t in trajectories) >= 4


def test_the_search_is_done_once(world, monkeypatch):
    found = np.eye(4)
    found[2, 3] = 0.3
    monkeypatch.setattr(power_grasp, "_search", lambda world: found)
    np.testing.assert_array_equal(power_grasp.power_grasp(world), found)
    monkeypatch.setattr(power_grasp, "_search", lambda world: pytest.fail("searched again"))
    np.testing.assert_array_equal(power_grasp.power_grasp(world), found)


def test_an_object_without_a_power_grasp_is_reported(world, monkeypatch):
    monkeypatch.setattr(power_grasp, "_search", lambda world: np.empty((0, 4)))
    with pytest.raises(NotGraspable, match="no power grasp found for rod in isyhand"):
        sample_sequence(world, "occ", np.random.default_rng(0))


def test_a_pose_without_room_to_turn_is_not_taken(world):
    lying = placement.above_palm(world.description, world.obj.mesh, np.eye(3)[:, [2, 0, 1]])
    assert power_grasp._has_room(world, lying)
    lying[2, 3] -= 0.01
    assert not power_grasp._has_room(world, lying)
