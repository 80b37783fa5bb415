# SPDX-License-Identifier: MIT
"""Uncertain joints and camera: what they do to a frame, and to how sure it is."""

import gtsam
import numpy as np
import pytest
from hand_frames import values_at
from jacobians import assert_jacobian_matches
from problems import frame, random_pose

from vtgtsam import EstimatorConfig, load_hand
from vtgtsam.factors.noise import distance_noise
from vtgtsam.factors.pad_distances import JointZeros, PadDistances
from vtgtsam.factors.penetration import penetration_factor
from vtgtsam.factors.tactile import tactile_factor
from vtgtsam.frame import check
from vtgtsam.knowledge import FrameInformation, fused
from vtgtsam.offsets import CalibrationPrior
from vtgtsam.sdf.search import ClosestPoints


def test_a_pads_distance_changes_with_the_zeros_as_its_point_moves():
    """d phi / d dq of a plane, phi = n . p + const, by moving the joints themselves."""
    hand = load_hand("isyhand")
    rng = np.random.default_rng(0)
    q = rng.uniform(0.1, 0.8, len(hand.joint_names))
    points_p = rng.normal(0.0, 0.005, (len(hand), 3))
    normals_h = rng.normal(size=(len(hand), 3))

    def points_h(joints):
        T_hp = hand.pad_transforms(joints)
        return np.einsum("kij,kj->ki", T_hp[:, :3, :3], points_p) + T_hp[:, :3, 3]

    jacobian = hand.zero_jacobian(q, points_h(q), normals_h)
    for j in range(len(q)):
        step = np.zeros(len(q))
        step[j] = 1e-6
        # the true angles are q - dq
        change = (points_h(q - step) - points_h(q + step)) / 2e-6
        expected = (normals_h * change).sum(axis=1)
        np.testing.assert_allclose(jacobian[:, j], expected, atol=1e-7)


def pads_with_zeros(seed):
    pads, obj, measurement, start = frame(seed)
    checked = check(measurement, pads)
    distances = PadDistances(ClosestPoints(pads, obj.sdf), checked.T_hp, checked.touching)
    G = np.random.default_rng(seed).normal(0.0, 0.05, (len(pads), 4))
    return distances, JointZeros(1, G), gtsam.Pose3(start)


@pytest.mark.parametrize("seed", range(4))
def test_the_pads_factors_are_exact_in_the_pose_and_in_the_zeros(seed):
    distances, zeros, T_ho = pads_with_zeros(seed)
    values = values_at(T_ho)
    values.insert(1, np.random.default_rng(seed).normal(0.0, 0.001, 4))
    touching = np.count_nonzero(distances.touching)
    for factor in (
        tactile_factor(0, distances, distance_noise(touching, 1.0), zeros),
        penetration_factor(0, distances, distance_noise(8, 1.0), zeros),
    ):
        # 1e-7: short of the next grid point becoming the closest
        assert_jacobian_matches(factor, values, step=1e-7, atol=2e-3)


def test_the_cameras_share_is_that_of_poses_seen_by_cameras_drawn_so():
    rng = np.random.default_rng(0)
    T_wo, origin = gtsam.Pose3(random_pose(rng, 1.0, 0.1)), np.array([0.1, -0.2, 0.3])
    config = EstimatorConfig(camera_sigma=(0.01, 0.002))
    prior = CalibrationPrior.of_config(config, np.zeros(0), origin)
    about = gtsam.Pose3(gtsam.Rot3(), origin)
    xi = []
    for _ in range(4000):
        e = rng.normal(size=6) * np.repeat([0.01, 0.002], 3)
        camera = about.compose(gtsam.Pose3.Expmap(e)).compose(about.inverse())
        xi.append(T_wo.localCoordinates(camera.compose(T_wo)))
    found, expected = np.cov(np.array(xi).T), prior.camera_share(T_wo)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(found / scale, expected / scale, atol=0.08)


def linear_frames(count, seed=0, offsets=3):
    """Frames x = z + H c + noise of a linear problem, and what the estimator makes of them: errors and covariances."""
    rng = np.random.default_rng(seed)
    H = np.random.default_rng(99).normal(size=(6, offsets))
    P = np.diag([1.0, 0.5, 2.0])[:offsets, :offsets]
    R = np.eye(6) * 0.3
    c = rng.multivariate_normal(np.zeros(offsets), P)
    S = np.linalg.inv(R + H @ P @ H.T)
    B = S @ H
    information = FrameInformation(S, np.zeros(6), B, S - B @ P @ B.T)
    estimate, knowledge = None, None
    for _ in range(count):
        z = H @ c + rng.multivariate_normal(np.zeros(6), R)
        if knowledge is None:
            estimate, knowledge = z, fused(information)
            continue
        memory = knowledge.information
        M = memory + S
        estimate = np.linalg.solve(M, memory @ estimate + S @ z)
        knowledge = fused(information, memory, knowledge, np.zeros((6, 6)))
    return estimate, knowledge, P


def covariance(knowledge, P):
    return knowledge.noise + knowledge.sensitivity @ P @ knowledge.sensitivity.T


def test_one_frames_covariance_is_the_inverse_of_its_information():
    _, knowledge, P = linear_frames(1)
    np.testing.assert_allclose(
        covariance(knowledge, P), np.linalg.inv(knowledge.information), rtol=1e-9
    )


@pytest.mark.parametrize("count", [1, 5, 40])
def test_offsets_do_not_average_out_and_the_covariance_says_so(count):
    nees = []
    for seed in range(400):
        estimate, knowledge, P = linear_frames(count, seed)
        nees.append(estimate @ np.linalg.solve(covariance(knowledge, P), estimate) / 6)
    assert np.mean(nees) == pytest.approx(1.0, abs=0.12)  # 400 draws of 6: sigma 0.03
