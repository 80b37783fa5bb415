# SPDX-License-Identifier: MIT
"""Sequences of twelve seconds: about a second each to make."""

from dataclasses import astuple

import numpy as np
import pytest
import trimesh
from short_course import shorten

from sim import constants as c
from sim.contacts import creep
from sim.hands import load_description
from sim.placement import above_palm
from sim.sampling import NotGraspable, sample_sequence
from sim.scene import OBJECT
from sim.simulate import Rejected, simulate, wrist_angle
from sim.world import World
from vtgtsam import ObjectModel, build_sdf
from vtgtsam.grasp import GraspController

SPACING = 0.001  # [m], of a pad's grid points


def world_with(mesh, **fields):
    description = load_description()
    obj = ObjectModel("test", build_sdf(mesh, 64), mesh, **fields)
    return World(description, description.load_hand(), obj)


@pytest.fixture(scope="module")
def world():
    return world_with(trimesh.creation.box((0.05, 0.06, 0.045)))


@pytest.fixture(scope="module")
def trajectory(world):
    return sample_sequence(world, "vary", np.random.default_rng(0)).trajectory


def same(a, b):
    return all(
        np.array_equal(x, y, equal_nan=True) for x, y in zip(astuple(a), astuple(b), strict=True)
    )


def test_samples_come_at_100_hz_and_frames_every_33_ms(trajectory):
    np.testing.assert_allclose(trajectory.time, np.arange(1201) * 0.01, atol=1e-12)
    np.testing.assert_allclose(trajectory.frame_time, np.arange(364) * 0.033, atol=1e-12)
    together = np.isin(np.round(trajectory.time * 1e3), np.round(trajectory.frame_time * 1e3))
    frames = np.isin(np.round(trajectory.frame_time * 1e3), np.round(trajectory.time * 1e3))
    np.testing.assert_array_equal(trajectory.joints[together], trajectory.frame_joints[frames])
    np.testing.assert_array_equal(trajectory.T_wo[together], trajectory.frame_T_wo[frames])


def test_poses_and_joints_of_a_sample_are_of_the_same_instant(world, monkeypatch):
    shorten(monkeypatch)
    lags = []

    def spied_T_wo(self):
        T_wo = type(self)._pose(self, OBJECT)
        lags.append(np.abs(T_wo[:3, 3] - self.data.joint(OBJECT).qpos[:3]).max())
        return T_wo

    monkeypatch.setattr(World, "T_wo", spied_T_wo)
    simulate(world, above_palm(world.description, world.obj.mesh, np.eye(3)))
    assert len(lags) > 30
    assert max(lags) == 0.0


def test_the_same_seed_gives_the_same_bytes_in_a_used_and_in_a_new_world(world, trajectory):
    again = sample_sequence(world, "vary", np.random.default_rng(0)).trajectory
    new = world_with(trimesh.creation.box((0.05, 0.06, 0.045)))
    alone = sample_sequence(new, "vary", np.random.default_rng(0)).trajectory
    assert same(trajectory, again)
    assert same(trajectory, alone)
    other = sample_sequence(world, "vary", np.random.default_rng(1)).trajectory
    assert not same(trajectory, other)


def test_the_hand_turns_backward_by_45_degrees_and_its_fingers_rise(trajectory):
    before = trajectory.time < c.TURN_START
    assert np.abs(trajectory.T_wh[before] - np.eye(4)).max() < 2e-3
    fingers = trajectory.T_wh[-1, :3, 0]
    np.testing.assert_allclose(fingers, (np.sqrt(0.5), 0.0, np.sqrt(0.5)), atol=2e-3)


def test_the_wrist_turns_evenly_between_its_two_instants():
    assert wrist_angle(c.TURN_START) == 0.0
    assert wrist_angle((c.TURN_START + c.TURN_END) / 2) == pytest.approx(np.pi / 8)
    assert wrist_angle(c.DURATION) == pytest.approx(np.pi / 4)


def test_the_object_stays_in_the_hand_and_never_jumps(trajectory):
    T_ho = np.linalg.solve(trajectory.T_wh, trajectory.T_wo)
    steps = np.linalg.norm(np.diff(T_ho[:, :3, 3], axis=0), axis=1)
    assert steps.max() < 0.005  # [m] in 10 ms
    held = trajectory.time >= c.TURN_START
    assert np.ptp(T_ho[held, :3, 3], axis=0).max() < c.MAX_SLIP


def test_with_dry_friction_a_held_object_creeps_a_third_as_fast_or_less(world, trajectory):
    dry = World(world.description, world.hand, world.obj, "dry")
    held = sample_sequence(dry, "vary", np.random.default_rng(0)).trajectory
    assert creep(held) < creep(trajectory) / 3


def test_a_pad_in_contact_lies_on_the_objects_surface(world, trajectory):
    for k in range(0, len(trajectory.time), 25):
        points, offsets = world.hand.pad_points(trajectory.joints[k], trajectory.T_wh[k])
        T = trajectory.T_wo[k]
        phi = world.obj.sdf.value((points - T[:3, 3]) @ T[:3, :3])
        nearest = np.minimum.reduceat(phi, offsets[:-1])
        # The rounded rim lies up to 2 mm beside the grid and 2 mm (1 - cos 45 deg) below it; a
        # distance field of 64 nodes rounds the box's edges by up to a millimetre.
        assert np.abs(nearest[trajectory.contacts[k]]).max(initial=0.0) < 0.0016
        assert nearest.min() > -0.0005


def test_pads_overlap_the_object_by_less_than_a_third_of_a_millimetre(trajectory):
    overlap = trajectory.overlap[trajectory.contacts]
    assert len(overlap) > 1000
    assert overlap.min() >= 0.0
    assert np.quantile(overlap, 0.95) < 0.0003


def test_pressure_is_where_contact_is(trajectory):
    assert (trajectory.pressure[~trajectory.contacts] == 0.0).all()
    assert (trajectory.pressure >= 0.0).all()
    pressed = trajectory.pressure[trajectory.contacts]
    assert 0.01 < np.median(pressed) < 2.0


def test_pads_carry_the_objects_weight_while_it_rests():
    world = world_with(trimesh.creation.box((0.05, 0.04, 0.02)), mass=0.2)
    description = world.description
    T_wo = above_palm(description, world.obj.mesh, np.eye(3))
    T_wo[1, 3] += 0.02  # onto the pads of the palm alone
    world.place(T_wo)
    for _ in range(1000):
        world.step()
    world.refresh()
    force, _ = world.touch()
    assert force.sum() == pytest.approx(0.2 * 9.81, rel=0.02)
    assert all("palm" in world.hand.pad_names[k] for k in np.flatnonzero(force))


@pytest.mark.parametrize("bits", [1, 0x7FFFFFFF])  # as in the hand's file; pads meet links too
def test_a_hand_that_closes_on_itself_feels_nothing(bits):
    world = world_with(trimesh.creation.box((0.05, 0.06, 0.045)))
    links = (world.model.geom_contype > 0) & ~world._object_geoms
    world.model.geom_contype[links] = bits
    far = np.eye(4)
    far[:3, 3] = (1.0, 0.0, 5.0)
    world.place(far)
    controller = GraspController(world.description, world.hand.joint_names, world.limits)
    for step in range(4000):
        if step % 10 == 0:
            world.command(controller.step(step * 1e-3, 0.01, world.joints()), 0.0)
        world.step()
    world.refresh()
    assert world.data.ncon > 0  # fingers and thumb do touch each other
    force, overlap = world.touch()
    assert (force == 0.0).all()
    assert np.isnan(overlap).all()


@pytest.mark.parametrize(
    ("shift", "reason"),
    [
        ((0.0, 0.0, -0.02), "overlaps the hand at the start"),
        ((0.0, 0.3, 0.0), "does not rest on the hand"),
        ((0.0, 0.0, 2.0), "does not rest on the hand"),  # still falling
    ],
)
def test_a_start_that_leads_to_no_grasp_is_rejected_with_its_reason(world, shift, reason):
    T_wo = above_palm(world.description, world.obj.mesh, np.eye(3))
    T_wo[:3, 3] += shift
    with pytest.raises(Rejected, match=reason):
        simulate(world, T_wo)


def test_an_object_that_only_lies_on_the_palm_is_not_grasped():
    mesh = trimesh.creation.box((0.05, 0.06, 0.045))
    limp = load_description().model_copy(update={"fingers": (), "thumb": ()})
    obj = ObjectModel("test", build_sdf(mesh, 16), mesh)
    world = World(limp, limp.load_hand(), obj)
    with pytest.raises(Rejected, match="is not grasped when the hand has closed"):
        simulate(world, above_palm(limp, mesh, np.eye(3)))


def test_reasons_are_kept_in_order_and_counted_when_no_sample_is_accepted(world, monkeypatch):
    reasons = iter(["slips", "overlaps", "slips", "falls", "holds"])

    def next_reason(world, T_wo, event):
        if (reason := next(reasons)) == "holds":
            return "trajectory"
        raise Rejected(reason)

    monkeypatch.setattr("sim.sampling.simulate", next_reason)
    monkeypatch.setattr("sim.sampling.TRIES", 3)
    with pytest.raises(NotGraspable, match="isyhand cannot grasp test: 2 x slips, 1 x overlaps$"):
        sample_sequence(world, "vary", np.random.default_rng(0))
    accepted = sample_sequence(world, "vary", np.random.default_rng(0))
    assert (accepted.trajectory, accepted.rejections) == ("trajectory", ("falls",))


def test_an_unknown_dataset_is_refused(world):
    with pytest.raises(ValueError, match="must be one of vary, occ, got 'some'"):
        sample_sequence(world, "some", np.random.default_rng(0))
