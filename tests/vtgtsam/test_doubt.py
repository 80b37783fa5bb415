# SPDX-License-Identifier: MIT
"""What touch says is doubted where vision is so wide that a frame is not linear."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest
from lump_grasp import grasp

from vtgtsam import EstimatorConfig, PoseEstimator
from vtgtsam import doubt as doubting
from vtgtsam.doubt import EVERY, MOST, OTHERWISE, OVER, WIDE, Doubt, otherwise
from vtgtsam.knowledge import FrameInformation
from vtgtsam.offsets import CalibrationPrior

SURE, WIDELY = (0.02, 0.0015), (0.5, 0.015)  # [rad], [m] of the tracker


def seen_with(sigma, seed=0, count=60):
    """A held lump, seen with one error of these sigmas that all but stays; pads, object, frames and truth."""
    pads, obj, frames, truth = grasp(count=count, seed=seed)
    rng = np.random.default_rng(seed)
    wrong = rng.normal(size=6) + 1e-3 * rng.normal(size=(count, 6))
    frames = [
        replace(f, T_wo_visual=T.retract(xi), visual_sigma=sigma, visual_correlation=20.0)
        for f, T, xi in zip(frames, truth, wrong * np.repeat(sigma, 3), strict=True)
    ]
    return pads, obj, frames, truth


def last(pads, obj, frames):
    """The last estimate, and what was doubted then."""
    estimator = PoseEstimator(pads, obj, EstimatorConfig(pad_sigma=0.0, camera_sigma=(0.0, 0.0)))
    estimates = [estimator.update(frame) for frame in frames]
    return estimates[-1], estimator._belief.doubt


def test_where_vision_is_sure_nothing_is_doubted_nor_looked_at():
    _, doubt = last(*seen_with(SURE)[:3])
    assert doubt == Doubt() and doubt.kappa == 1.0


def test_where_nothing_touches_nothing_is_looked_at():
    pads, obj, frames, _ = seen_with(WIDELY)
    _, doubt = last(pads, obj, [replace(f, contacts=np.zeros(len(pads), bool)) for f in frames])
    assert doubt == Doubt()


def nees(estimate, T_wo):
    xi = estimate.T_wo.localCoordinates(T_wo)
    return xi @ np.linalg.solve(estimate.covariance, xi) / 6.0


def test_where_vision_is_wide_the_covariance_holds_better_for_it(monkeypatch):
    grasps = [seen_with(WIDELY, seed) for seed in range(12)]
    doubted = [nees(last(*g[:3])[0], g[3][-1]) for g in grasps]
    monkeypatch.setattr(doubting, "EVERY", np.inf)
    linear = [nees(last(*g[:3])[0], g[3][-1]) for g in grasps]
    assert np.mean(doubted) < 0.5 * np.mean(linear)


def test_a_grasp_that_is_replayed_is_doubted_alike():
    pads, obj, frames, _ = seen_with(WIDELY, seed=3)
    one, other = (last(pads, obj, frames) for _ in range(2))
    assert one[1] == other[1] and one[1].kappa > 1.0
    np.testing.assert_array_equal(one[0].covariance, other[0].covariance)


def test_the_mean_is_over_the_last_poses():
    doubt = Doubt()
    for n in range(100):
        doubt = doubt.after(n * EVERY, 7.0, cost=0.0)
    assert doubt.kappa == pytest.approx(7.0, rel=1e-3)
    assert doubt.weight == pytest.approx(OVER, rel=1e-3)
    assert doubt.after(25.0, 1e9, cost=0.0).kappa == pytest.approx(7.0 + (MOST - 7.0) / OVER)
    stuck = doubt.after(25.0, 1e9, cost=50.0)
    assert stuck.kappa == pytest.approx(7.0, rel=1e-3) and stuck.looked_at == 25.0
    assert Doubt(mean=0.2).kappa == 1.0  # never is more believed than is said


def test_when_to_look():
    wide = np.diag((1.1 * WIDE) ** 2)
    assert Doubt().is_due(0.0, wide) and not Doubt().is_due(0.0, wide / 2.0)
    assert not Doubt(looked_at=1.0).is_due(1.0 + EVERY / 2.0, wide)
    assert Doubt(looked_at=1.0).is_due(1.0 + EVERY, wide)


def test_the_pose_comes_out_otherwise_as_its_covariance_says():
    sigmas = np.array([0.1, 0.2, 0.3, 0.01, 0.02, 0.03])
    T = gtsam.Pose3(gtsam.Rot3.Rz(1.0), [0.1, 0.2, 0.3])
    for n, expected in enumerate(OTHERWISE):
        there = otherwise(T, np.diag(sigmas**2), n * EVERY)
        np.testing.assert_allclose(T.localCoordinates(there) / sigmas, expected, atol=1e-6)


@pytest.mark.parametrize("sigma", [1.0, 1e4, 1e150])
def test_vision_that_knows_next_to_nothing_is_no_reason_to_stop(sigma):
    pads, obj, frames, _ = seen_with(SURE, count=10)
    estimate, doubt = last(pads, obj, [replace(f, visual_sigma=(sigma, sigma)) for f in frames])
    assert estimate.status == "ok" and np.isfinite(estimate.T_wo.matrix()).all()
    assert np.isfinite(doubt.kappa)


def test_doubt_widens_what_the_hand_says_and_leaves_how_far_offsets_pull():
    rng = np.random.default_rng(0)
    prior = CalibrationPrior.of_config(EstimatorConfig(), np.zeros(3, dtype=int), np.zeros(3))
    pull = rng.normal(size=(6, len(prior.covariance)))
    information = 1e3 * np.eye(6)
    says = FrameInformation(information, np.ones(6), pull, information - pull @ prior.apart @ pull.T)  # fmt: skip
    less = says.doubted(4.0, prior)
    np.testing.assert_allclose(less.information, information / 4.0)
    np.testing.assert_allclose(
        np.linalg.solve(less.information, less.pull), np.linalg.solve(information, pull)
    )
    np.testing.assert_allclose(less.noise, less.information - less.pull @ prior.apart @ less.pull.T)
    for mine, its in zip(says.doubted(1.0, prior), says, strict=True):
        np.testing.assert_allclose(mine, its)
