# SPDX-License-Identifier: MIT
"""The difference of two images tells how the object moved in the hand, whatever both have wrong."""

import gtsam
import numpy as np
import pytest
from gtsam.symbol_shorthand import X
from lump_grasp import PERIOD, errors

from vtgtsam import EstimatorConfig, Measurement, Pad, PadSet, PoseEstimator, load_object
from vtgtsam.frame import check
from vtgtsam.seen_motion import ERRORS, Seen, seen_motion

CONFIG = EstimatorConfig()
WALK = np.diag(np.repeat([0.03, 0.001], 3) ** 2)
COVARIANCE = np.diag(np.array([0.01, 0.02, 0.03, 0.0005, 0.001, 0.0007]) ** 2)
MOVED = np.array([0.02, -0.01, 0.015, 0.0006, -0.0004, 0.0005])
PADS = PadSet([Pad("tip", (0.01, 0.01))])


def frame_seen_at(T_ho_visual):
    T_wp = np.eye(4)[None]
    return check(
        Measurement(1.0, [1], T_wp=T_wp, T_wo_visual=T_ho_visual, visual_covariance=COVARIANCE),
        PADS,
    )


def without_robust_loss(before, moved):
    """For a visual pose that moved by so much: the motion, and the share of the walk that is left."""
    config = EstimatorConfig(log_theta_vis_mem=20.0)  # no difference is too large
    frame = frame_seen_at(before.T_ho_visual.retract(moved))
    return seen_motion(before, before.T_ho, frame, WALK, config)


def test_it_is_what_gtsam_makes_of_a_random_walk_and_a_between_factor():
    """The last pose held, the next one's marginal is the walk's and the difference's product."""
    before = Seen(gtsam.Pose3(), gtsam.Pose3())
    motion, left = without_robust_loss(before, MOVED)
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    held = gtsam.noiseModel.Constrained.All(6)
    walk = gtsam.noiseModel.Gaussian.Covariance(WALK)
    two = gtsam.noiseModel.Gaussian.Covariance(ERRORS * COVARIANCE)
    graph.add(gtsam.PriorFactorPose3(X(0), gtsam.Pose3(), held))
    graph.add(gtsam.BetweenFactorPose3(X(0), X(1), gtsam.Pose3(), walk))
    graph.add(gtsam.BetweenFactorPose3(X(0), X(1), gtsam.Pose3().retract(MOVED), two))
    values.insert(X(0), gtsam.Pose3())
    values.insert(X(1), gtsam.Pose3())
    least = gtsam.GaussNewtonOptimizer(graph, values).optimize()
    expected = gtsam.Pose3().localCoordinates(least.atPose3(X(1)))
    np.testing.assert_allclose(motion, expected, atol=0.01 * np.abs(MOVED).max())
    known = gtsam.Marginals(graph, least).marginalCovariance(X(1))
    np.testing.assert_allclose(left @ WALK, known, rtol=0.05, atol=0.01 * known.max())


def test_what_both_images_have_wrong_cancels():
    beside = gtsam.Pose3(gtsam.Rot3(), [0.02, -0.01, 0.03])
    here, _ = without_robust_loss(Seen(gtsam.Pose3(), gtsam.Pose3()), MOVED)
    there, _ = without_robust_loss(Seen(beside, gtsam.Pose3()), MOVED)
    np.testing.assert_allclose(there, here, atol=1e-12)


def test_what_the_estimate_has_moved_since_the_image_is_not_moved_again():
    moved = gtsam.Pose3().retract(MOVED)
    before = Seen(gtsam.Pose3(), gtsam.Pose3())
    motion, _ = seen_motion(before, moved, frame_seen_at(moved), WALK, CONFIG)
    np.testing.assert_allclose(motion, np.zeros(6), atol=1e-12)


@pytest.mark.parametrize("jump", [[0.0, 0.0, np.pi, 0.0, 0.0, 0.0], [0, 0, 0, 0.1, 0, 0]])
def test_a_jump_is_no_motion(jump):
    before = Seen(gtsam.Pose3(), gtsam.Pose3())
    frame = frame_seen_at(gtsam.Pose3().retract(np.array(jump)))
    motion, left = seen_motion(before, before.T_ho, frame, WALK, CONFIG)
    np.testing.assert_array_equal(motion, np.zeros(6))
    np.testing.assert_array_equal(left, np.eye(6))


@pytest.mark.parametrize("sigma", [1e-3, 1e-6, 1e-9, 1e-12])
def test_a_tracker_that_is_surer_than_numbers_are_leaves_a_covariance(sigma):
    pad = gtsam.Pose3().matrix()[None]
    estimator = PoseEstimator(PADS, load_object("ball"))
    for n in range(5):
        T_wo = gtsam.Pose3(gtsam.Rot3(), [0.001 * n, 0.0, 0.05])
        estimate = estimator.update(
            Measurement(n * PERIOD, [0], T_wp=pad, T_wo_visual=T_wo, visual_sigma=(sigma, sigma))
        )
    assert np.isfinite(estimate.T_wo.matrix()).all() and estimate.faults == ()
    assert (np.linalg.eigvalsh(estimate.covariance) > 0.0).all()
    np.testing.assert_allclose(estimate.T_wo.translation(), T_wo.translation(), atol=2e-3)


@pytest.mark.parametrize("frames_an_image", [1, 8])
def test_an_object_that_a_finger_pushes_is_followed_by_a_camera_that_may_be_off(frames_an_image):
    """The camera may be off by 1.2 mm, which is the same in all images: the tracker's 0.2 mm tell of the motion."""
    obj = load_object("ball")
    low = float(obj.mesh.bounds[0, 2])
    sigma, speed = 0.0002, 0.05  # [m], [m/s]
    estimator = PoseEstimator(PADS, obj)
    rng, estimates, truth = np.random.default_rng(0), [], []
    for n in range(30 * frames_an_image):  # a pad below the ball slides along, which it cannot feel
        time = PERIOD * n / frames_an_image
        along = speed * time
        T_wp = gtsam.Pose3(gtsam.Rot3(), [along, 0.0, 0.0])
        T_wo = gtsam.Pose3(gtsam.Rot3(), [along, 0.0, -low])
        seen = T_wo.retract(np.concatenate([np.zeros(3), sigma * rng.normal(size=3)]))
        measurement = Measurement(
            time, [1], T_wp=T_wp.matrix()[None], T_wh=gtsam.Pose3(),
            T_wo_visual=None if n % frames_an_image else seen,
            visual_sigma=(0.1, sigma), visual_correlation=0.5,
        )  # fmt: skip
        truth.append(T_wo)
        estimates.append(estimator.update(measurement))
    assert errors(estimates, truth).max() < 0.006  # of 50 mm
