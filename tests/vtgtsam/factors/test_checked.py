# SPDX-License-Identifier: MIT
"""Each way a callback can break GTSAM's contract ends in one clear error, never in a crash or in silence."""

import pickle

import gtsam
import numpy as np
import pytest

from vtgtsam.exceptions import FactorError
from vtgtsam.factors.checked import checked_factor

KEY = 7
NOISE = gtsam.noiseModel.Isotropic.Sigma(2, 0.5)
GOOD_RESIDUAL = np.array([0.1, -0.2])
GOOD_JACOBIAN = np.arange(12.0).reshape(2, 6)


def factor_with(residual=GOOD_RESIDUAL, jacobian=GOOD_JACOBIAN, noise=NOISE):
    def error(factor, values, jacobians):
        if jacobians is not None and jacobian is not None:
            jacobians[0] = jacobian
        return residual

    return checked_factor(noise, [KEY], error)


def values():
    result = gtsam.Values()
    result.insert(KEY, gtsam.Pose3())
    return result


def optimize(factor):
    graph = gtsam.NonlinearFactorGraph()
    graph.push_back(factor)
    return gtsam.LevenbergMarquardtOptimizer(graph, values()).optimize()


@pytest.mark.parametrize(
    ("jacobian", "message"),
    [
        (None, r"left jacobians\[0\] unset"),
        (np.ones(6), r"must have shape \(2, 6\), got \(6,\)"),
        (np.ones((1, 6)), r"must have shape \(2, 6\), got \(1, 6\)"),
        (np.ones((2, 3)), r"must have shape \(2, 6\), got \(2, 3\)"),
        (np.full((2, 6), np.nan), "not finite"),
    ],
    ids=["unset", "one-dimensional", "too few rows", "wrong columns", "nan"],
)
def test_a_wrong_jacobian_raises(jacobian, message):
    with pytest.raises(FactorError, match=message):
        optimize(factor_with(jacobian=jacobian))


@pytest.mark.parametrize(
    ("residual", "message"),
    [
        (np.array([np.nan, 0.0]), "not finite"),
        (np.array([np.inf, 0.0]), "not finite"),
        (np.array([0.1]), r"shape \(2,\).*got shape \(1,\)"),
        (0.1, r"shape \(2,\).*got shape \(\)"),
        (np.zeros((2, 1)), r"shape \(2,\).*got shape \(2, 1\)"),
    ],
    ids=["nan", "inf", "too short", "scalar", "column"],
)
def test_a_wrong_residual_raises_with_and_without_jacobians(residual, message):
    factor = factor_with(residual=residual)
    with pytest.raises(FactorError, match=message):
        factor.error(values())
    with pytest.raises(FactorError, match=message):
        optimize(factor)


def test_writing_a_jacobian_in_place_raises():
    def error(factor, values, jacobians):
        if jacobians is not None:
            jacobians[0][:] = GOOD_JACOBIAN
        return GOOD_RESIDUAL

    with pytest.raises(FactorError, match=r"must assign jacobians\[0\] = J"):
        optimize(checked_factor(NOISE, [KEY], error))


@pytest.mark.parametrize("sigmas", [[0.5, 0.0], [0.5, np.nan], [0.5, np.inf]])
def test_an_unusable_sigma_raises_at_once(sigmas):
    noise = gtsam.noiseModel.Diagonal.Sigmas(np.array(sigmas), False)
    with pytest.raises(FactorError, match="finite and positive"):
        factor_with(noise=noise)


def test_an_unusable_sigma_behind_a_robust_loss_raises_too():
    welsch = gtsam.noiseModel.mEstimator.Welsch.Create(1.0)
    flat = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.5, 0.0]), False)
    with pytest.raises(FactorError, match="finite and positive"):
        factor_with(noise=gtsam.noiseModel.Robust.Create(welsch, flat))


def test_what_the_callback_raises_passes_through():
    def error(factor, values, jacobians):
        raise ZeroDivisionError("from the callback")

    with pytest.raises(ZeroDivisionError, match="from the callback"):
        optimize(checked_factor(NOISE, [KEY], error))


def test_a_missing_key_raises():
    def error(factor, values, jacobians):
        values.atPose3(KEY + 1)

    with pytest.raises(RuntimeError, match="does not exist"):
        checked_factor(NOISE, [KEY], error).error(values())


def test_a_factor_cannot_be_pickled():
    with pytest.raises(TypeError, match="pickle"):
        pickle.dumps(factor_with())


def test_dimensions_are_checked_for_each_key():
    def error(factor, values, jacobians):
        if jacobians is not None:
            jacobians[0], jacobians[1] = np.ones((2, 6)), np.ones((2, 6))
        return GOOD_RESIDUAL

    graph_values = values()
    graph_values.insert(KEY + 1, np.zeros(3))
    factor = checked_factor(NOISE, [KEY, KEY + 1], error, dimensions=[6, 3])
    with pytest.raises(FactorError, match=r"jacobians\[1\] must have shape \(2, 3\)"):
        factor.linearize(graph_values)
    with pytest.raises(FactorError, match="a dimension for each of 2 keys, got 1"):
        checked_factor(NOISE, [KEY, KEY + 1], error, dimensions=[6])


def test_a_good_callback_is_linearized_as_it_says():
    factor = factor_with(jacobian=GOOD_JACOBIAN.astype(np.float32))
    A, b = factor.linearize(values()).jacobian()
    np.testing.assert_allclose(A, GOOD_JACOBIAN / 0.5)
    np.testing.assert_allclose(b, -GOOD_RESIDUAL / 0.5)
