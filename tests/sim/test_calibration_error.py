# SPDX-License-Identifier: MIT
import gtsam
import numpy as np

from sim.calibration import CalibrationError, with_bad_edges


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


def test_the_covariance_is_that_of_poses_seen_by_cameras_drawn_so():
    rng = np.random.default_rng(0)
    T_wo = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.3, -0.4, 1.0), np.array([0.1, 0.02, 0.05]))
    errors = [CalibrationError.drawn(1, rng) for _ in range(4000)]
    xi = np.array([T_wo.localCoordinates(error.T_error * T_wo) for error in errors])
    expected, found = errors[0].covariance(T_wo), xi.T @ xi / len(xi)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(found / scale, expected / scale, atol=0.08)
    assert not CalibrationError.none(1).covariance(T_wo).any()
