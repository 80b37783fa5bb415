# SPDX-License-Identifier: MIT
import gtsam
import numpy as np
import pytest

from benchmarks.consistency import nees


def test_errors_drawn_from_the_covariance_have_a_mean_of_1_and_others_have_not():
    rng = np.random.default_rng(0)
    root = np.diag([0.01, 0.02, 0.005, 1e-3, 2e-3, 5e-4]) @ (
        np.eye(6) + 0.3 * rng.normal(size=(6, 6))
    )
    covariance, T_true = root @ root.T, gtsam.Pose3(gtsam.Rot3.RzRyRx(1, 2, 3), np.ones(3))
    draws = [T_true.retract(root @ rng.standard_normal(6)) for _ in range(2000)]
    assert np.mean([nees(T, covariance, T_true) for T in draws]) == pytest.approx(1, abs=0.05)
    assert np.mean([nees(T, covariance / 4, T_true) for T in draws]) == pytest.approx(4, abs=0.2)


def test_a_direction_that_nothing_measures_cannot_be_judged():
    covariance = np.diag([1, 1, 1, 1, 1, np.inf])
    assert np.isnan(nees(gtsam.Pose3(), covariance, gtsam.Pose3()))
