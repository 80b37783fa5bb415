# SPDX-License-Identifier: MIT
import dataclasses

import numpy as np
import pytest

from benchmarks import problems
from benchmarks.grasps import Grasp
from benchmarks.problem import Problem
from vtgtsam import GridSdf, Pad


@pytest.fixture(scope="module")
def tracked():
    return problems.sequence(30, sdf=problems.lump(48))


def angle(T):
    return np.degrees(np.arccos(np.clip((np.trace(T[:3, :3]) - 1) / 2, -1, 1)))


def test_the_standard_problem_has_7236_points_on_16_pads():
    problem = problems.single_frames(1, sdf=problems.lump(32))
    assert len(problem.points_p) == 7236
    assert problem.pads == 16
    assert problems.lump().values.shape == (128, 128, 128)


@pytest.mark.parametrize("make", [problems.single_frames, problems.sequence])
def test_the_same_seed_gives_the_same_problem_and_another_seed_another(make):
    sdf = problems.lump(32)
    a, b, c = make(2, seed=1, sdf=sdf), make(2, seed=1, sdf=sdf), make(2, seed=2, sdf=sdf)
    for field in dataclasses.fields(Problem):
        np.testing.assert_array_equal(getattr(a, field.name), getattr(b, field.name))
    assert not np.array_equal(a.T_wp, c.T_wp)


def test_a_saved_problem_is_read_back_as_it_was(tracked, tmp_path):
    tracked.save(tmp_path / "problem.npz")
    read = Problem.load(tmp_path / "problem.npz")
    for field in dataclasses.fields(Problem):
        value = getattr(tracked, field.name)
        np.testing.assert_array_equal(getattr(read, field.name), value)
        assert type(getattr(read, field.name)) is type(value)


def test_the_object_slips_in_the_hand_by_fractions_of_a_millimetre_and_a_degree(tracked):
    in_pad = np.linalg.inv(tracked.T_wp[:, 0]) @ tracked.T_true
    steps = np.linalg.inv(in_pad[:-1]) @ in_pad[1:]
    assert 0.05e-3 < np.median(np.linalg.norm(steps[:, :3, 3], axis=1)) < 0.5e-3
    assert 0.1 < np.median([angle(T) for T in steps]) < 0.6


def test_a_pad_reports_contact_exactly_where_it_is_near_the_true_object(tracked):
    sdf = GridSdf(tracked.values, tracked.lower, tracked.upper)
    for n in range(0, tracked.frames, 10):
        for k in range(tracked.pads):
            T_op = np.linalg.inv(tracked.T_true[n]) @ tracked.T_wp[n, k]
            points = tracked.points_p[tracked.offsets[k] : tracked.offsets[k + 1]]
            nearest = sdf.value(points @ T_op[:3, :3].T + T_op[:3, 3]).min()
            assert (nearest < problems.TOUCH) == tracked.contacts[n, k]
            assert nearest > -2e-3  # no pad reaches through the object's side
    assert 0.5 < tracked.contacts.mean() < 0.95


def test_a_pad_across_a_thin_wall_is_moved_out_of_it():
    axis = np.linspace(-0.06, 0.06, 64)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    can = np.maximum(np.hypot(x, y) - 0.033, np.abs(z) - 0.04)
    handle = np.maximum.reduce([np.abs(y) - 0.003, np.abs(z) - 0.04, -x, x - 0.055])  # 6 mm thick
    grasp = Grasp(
        np.random.default_rng(0),
        GridSdf(np.minimum(can, handle), [-0.06] * 3, [0.06] * 3),
        problems.standard_pads(),
    )
    gaps = np.zeros(16)
    distances = grasp.distances(grasp.closed(grasp.T_op, gaps))
    np.testing.assert_allclose(distances, gaps, atol=2e-4)


def test_starts_and_visual_poses_are_millimetres_and_degrees_from_the_truth():
    problem = problems.single_frames(20, sdf=problems.lump(32))
    for T in (problem.T_start, problem.T_visual):
        off = np.linalg.inv(problem.T_true) @ T
        assert 1e-3 < np.median(np.linalg.norm(off[:, :3, 3], axis=1)) < 5e-3
        assert 1 < np.median([angle(A) for A in off]) < 4


def test_any_pads_and_settings_can_be_asked_for():
    pads = [Pad(f"p{k}", (0.01, 0.01)) for k in range(5)]
    problem = problems.sequence(2, pads=pads, sdf=problems.lump(32), iterations=3, w_tac=10.0)
    assert problem.pads == 5
    assert (problem.iterations, problem.w_tac) == (3, 10.0)


def test_a_field_that_is_nowhere_negative_is_refused():
    sdf = GridSdf(np.full((8, 8, 8), 1.0), [-0.1] * 3, [0.1] * 3)
    with pytest.raises(ValueError):
        problems.single_frames(1, sdf=sdf)
