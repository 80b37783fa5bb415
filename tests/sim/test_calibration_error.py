# SPDX-License-Identifier: MIT
import gtsam
import numpy as np

from sim.calibration import CalibrationError, with_bad_edges
from sim.sequence import SequenceName, Settings, calibration_error


def test_the_camera_is_off_by_2_mm_and_1_degree_and_joints_by_about_1_degree():
    errors = [CalibrationError.drawn(15, np.random.default_rng(seed)) for seed in range(200)]
    for error in errors:
        angle = np.linalg.norm(gtsam.Rot3.Logmap(error.T_error.rotation()))
        np.testing.assert_allclose(np.rad2deg(angle), 1.0)
        np.testing.assert_allclose(np.linalg.norm(error.T_error.translation()), 0.002)
    joints = np.rad2deg(np.concatenate([error.joints for error in errors]))
    assert abs(joints.mean()) < 0.1  # 3,000 samples: 5 standard errors
    assert abs(joints.std() - 1.0) < 0.07


def test_the_same_seed_gives_the_same_error_and_another_one_another():
    first, again, other = (CalibrationError.drawn(3, np.random.default_rng(s)) for s in (1, 1, 2))
    assert first.T_error.equals(again.T_error, 0.0)
    assert (first.joints == again.joints).all()
    assert not first.T_error.equals(other.T_error, 1e-6)


def test_no_error_changes_nothing():
    error = CalibrationError.none(4)
    depth = np.random.default_rng(0).uniform(0.5, 1.0, (20, 20))
    assert error.T_error.equals(gtsam.Pose3(), 0.0)
    assert (error.joints == 0).all()
    assert error.spoil_depth(depth, np.random.default_rng(0)) is depth


def step_image():
    depth = np.full((60, 80), 1.0)
    depth[20:40, 30:50] = 0.7
    return depth


def test_depth_fails_at_edges_and_nowhere_else():
    depth = step_image()
    spoiled = with_bad_edges(depth, np.random.default_rng(0))
    changed = spoiled != depth
    near_edge = np.zeros(depth.shape, bool)
    near_edge[19:41, 29:51] = True
    near_edge[21:39, 31:49] = False
    assert not (changed & ~near_edge).any()
    share_of_holes = (spoiled[near_edge] == 0).mean()
    assert 0.35 < share_of_holes < 0.65
    flying = near_edge & (spoiled > 0.7) & (spoiled < 1.0)
    assert 0.15 < flying[near_edge].mean() < 0.35


def test_before_nothing_there_are_holes_but_nothing_flies():
    depth = step_image()
    depth[depth == 1.0] = 0.0
    spoiled = with_bad_edges(depth, np.random.default_rng(0))
    assert set(np.unique(spoiled)) == {0.0, 0.7}
    assert (spoiled[21:39, 31:49] == 0.7).all()
    assert (spoiled[depth == 0] == 0).all()


def test_a_robot_is_off_by_the_same_whatever_it_grasps():
    first, again, other = (CalibrationError.of_robot(n, 15) for n in (3, 3, 4))
    assert first.imperfect and first.T_error.equals(again.T_error, 0.0)
    np.testing.assert_array_equal(first.joints, again.joints)
    assert not first.T_error.equals(other.T_error, 1e-6)
    here = calibration_error(Settings("vary", seed=1, robot=3), SequenceName("can", 0), 15)
    there = calibration_error(Settings("occ", seed=2, robot=3), SequenceName("mug", 4), 15)
    assert here.T_error.equals(there.T_error, 0.0) and here.T_error.equals(first.T_error, 0.0)


def test_sequences_without_a_robot_have_errors_of_their_own():
    settings = Settings("vary", seed=1, calibration_error=True)
    one, two = (calibration_error(settings, SequenceName("can", n), 15) for n in (0, 1))
    assert not one.T_error.equals(two.T_error, 1e-6)
    assert not calibration_error(Settings("vary"), SequenceName("can", 0), 15).imperfect
