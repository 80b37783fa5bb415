# SPDX-License-Identifier: MIT
"""A frame's graph as a value: what it holds, and what can be built of it."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest
from gtsam.symbol_shorthand import A, B, X
from problems import alone, as_reference, box_sdf, frame, lump_sdf, pads_around

from vtgtsam import (
    ClosestPoints,
    EstimatorConfig,
    Measurement,
    PadSet,
    PoseEstimator,
    build_graph,
    checked_factor,
)
from vtgtsam.optimize import levenberg_marquardt

CONFIGS = [
    EstimatorConfig.simulation(),
    EstimatorConfig.real_world(),
    alone(),
    alone(log_theta_vis=-2.0, w_pen=100.0),
]
HARDLY = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.01] * 3 + [0.001] * 3))


def at(**poses):
    values = gtsam.Values()
    for key, pose in poses.values():
        values.insert(key, pose)
    return values


def one(key, T):
    return at(only=(key, gtsam.Pose3(T) if isinstance(T, np.ndarray) else T))


def solve(graph, values, iterations=50):
    return levenberg_marquardt(graph, values, 100.0, iterations).values


@pytest.mark.parametrize("config", CONFIGS)
@pytest.mark.parametrize("seed", range(5))
def test_the_cost_and_its_linearization_are_the_independent_implementations(seed, config):
    pads, obj, measurement, start = frame(seed)
    graph = build_graph(measurement, ClosestPoints(pads, obj.sdf), X(0), config)
    problem, values = as_reference(pads, obj, measurement, config), one(X(0), start)
    assert graph.error(values) == pytest.approx(problem.cost(start), rel=1e-9)
    information, gradient = graph.linearize(values).hessian()
    expected_information, expected_gradient = problem.normal_equations(start)
    scale = np.abs(expected_information).max()
    np.testing.assert_allclose(information, expected_information, atol=1e-8 * scale)
    scale = np.abs(expected_gradient).max()
    np.testing.assert_allclose(gradient, expected_gradient, atol=1e-8 * scale)


def test_its_factors_are_gtsams_prior_and_two_custom_factors_on_the_callers_key():
    pads, obj, measurement, _ = frame(1)
    closest = ClosestPoints(pads, obj.sdf)
    graph = build_graph(measurement, closest, B(7))
    kinds = [type(graph.at(n)) for n in range(graph.size())]
    assert kinds == [gtsam.PriorFactorPose3, gtsam.CustomFactor, gtsam.CustomFactor]
    assert all(list(graph.at(n).keys()) == [B(7)] for n in range(3))


@pytest.mark.parametrize(
    ("method", "seen", "touched", "count"),
    [
        ("vis+tac+pen", True, True, 3),
        ("vis+tac+pen", False, True, 2),
        ("vis+tac+pen", True, False, 2),
        ("vis+pen", True, True, 2),
        ("vis+pen", False, False, 1),
        ("vis", True, True, 1),
        ("vis", False, True, 0),
    ],
)
def test_a_frame_has_the_factors_that_it_and_the_method_have(method, seen, touched, count):
    pads, obj, measurement, _ = frame(2)
    measurement = replace(
        measurement,
        contacts=np.full(8, touched),
        T_wo_visual=measurement.T_wo_visual if seen else None,
    )
    config = EstimatorConfig(method=method)
    graph = build_graph(measurement, ClosestPoints(pads, obj.sdf), X(0), config)
    assert graph.size() == count


def test_it_is_the_graph_that_the_estimator_solves():
    pads, obj, measurement, start = frame(3)
    config = alone()
    estimator = PoseEstimator(pads, obj, config)
    estimator.reset(gtsam.Pose3(start))
    estimate = estimator.update(measurement)
    graph = build_graph(measurement, ClosestPoints(pads, obj.sdf), X(0), config)
    solution = levenberg_marquardt(graph, one(X(0), start), config.damping, config.iterations)
    assert solution.values.atPose3(X(0)).equals(estimate.T_wo, 1e-9)
    assert solution.error == pytest.approx(estimate.error, rel=1e-9)


def test_the_unknown_is_the_object_in_the_hand():
    pads, obj, measurement, start = frame(4)
    T_wh = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.3, -0.2, 1.0), np.array([0.1, 0.2, 0.3]))
    closest = ClosestPoints(pads, obj.sdf)
    in_world = build_graph(measurement, closest, X(0))
    in_hand = build_graph(replace(measurement, T_wh=T_wh), closest, X(0))
    T_ho = T_wh.between(gtsam.Pose3(start))
    expected = in_world.error(one(X(0), start))
    assert in_hand.error(one(X(0), T_ho)) == pytest.approx(expected, rel=1e-9)


def test_a_graph_is_a_value_that_no_later_frame_changes():
    pads, obj, measurement, start = frame(5)
    closest, values = ClosestPoints(pads, obj.sdf), one(X(0), start)
    graph = build_graph(measurement, closest, X(0))
    error, linear = graph.error(values), graph.linearize(values)
    moved = measurement.T_wp.copy()
    moved[:, :3, 3] += 0.003
    other = build_graph(
        replace(measurement, T_wp=moved, contacts=~np.asarray(measurement.contacts)), closest, X(0)
    )
    assert other.error(values) != error
    measurement.T_wp[:] = np.nan
    measurement.contacts[:] = False
    assert graph.error(values) == error
    assert graph.linearize(values).equals(linear, 1e-12)
    del measurement, pads, obj, closest
    assert graph.error(one(X(0), start)) == error


def test_graphs_that_share_a_search_are_those_that_do_not():
    pads, obj, measurement, start = frame(6)
    shared, values = ClosestPoints(pads, obj.sdf), one(X(0), start)
    rng = np.random.default_rng(6)
    frames = [
        replace(measurement, T_wp=measurement.T_wp @ gtsam.Pose3.Expmap(xi).matrix())
        for xi in rng.normal(0, 0.003, (5, 6))
    ]
    together = [build_graph(m, shared, X(0)) for m in frames]
    alone = [build_graph(m, ClosestPoints(pads, obj.sdf), X(0)) for m in frames]
    for _ in range(2):
        for one_graph, other in zip(together, alone, strict=True):
            assert one_graph.error(values) == other.error(values)


@pytest.mark.parametrize(
    ("broken", "message"),
    [
        ({"contacts": [True]}, r"contacts must have shape \(8,\)"),
        ({"time": np.nan}, "the measurement cannot be used: time not finite"),
        ({"visual_sigma": (0.1, 0.0)}, "cannot be used: vision's covariance unusable"),
    ],
)
def test_a_frame_that_cannot_be_used_is_refused(broken, message):
    pads, obj, measurement, _ = frame(7)
    with pytest.raises(ValueError, match=message):
        build_graph(replace(measurement, **broken), ClosestPoints(pads, obj.sdf), X(0))


def test_a_factor_of_ones_own_pulls_with_its_weight():
    pads, obj, measurement, start = frame(8)
    graph = build_graph(measurement, ClosestPoints(pads, obj.sdf), X(0))
    before = solve(graph, one(X(0), start)).atPose3(X(0))
    goal = before.x() + 0.005

    def error(factor, values, jacobians):
        T = values.atPose3(factor.keys()[0])
        if jacobians is not None:
            jacobians[0] = np.hstack([np.zeros(3), T.rotation().matrix()[0]])[None]
        return np.array([T.x() - goal])

    graph.push_back(checked_factor(gtsam.noiseModel.Isotropic.Sigma(1, 1e-5), [X(0)], error))
    after = solve(graph, one(X(0), before)).atPose3(X(0))
    assert after.x() == pytest.approx(goal, abs=1e-4)


def window(seed=9, count=6, outlier=3):
    """Frames of a lump that rests in the hand; one visual pose is 2 cm off. The truth is the identity."""
    pads, T_hp = pads_around(seed, count=10, distance=0.05)  # nothing touches
    closest, rng = ClosestPoints(pads, lump_sdf(seed)), np.random.default_rng(seed)
    for n in range(count):
        T_wh = gtsam.Pose3(gtsam.Rot3.Ry(0.1 * n), np.array([0.1 * n, 0.0, 0.3]))
        error = np.concatenate([rng.normal(0, 0.01, 3), rng.normal(0, 0.001, 3)])
        T_ho_seen = gtsam.Pose3.Expmap(error + (n == outlier) * np.array([0, 0, 0, 0.02, 0, 0]))
        yield (
            closest,
            Measurement(
                time=0.1 * n,
                contacts=np.zeros(10, bool),
                T_wh=T_wh,
                T_wp=T_wh.matrix() @ T_hp,
                T_wo_visual=T_wh.compose(T_ho_seen),
            ),
            T_ho_seen,
        )


def test_frames_of_a_window_hold_each_other():
    graph, values, seen = gtsam.NonlinearFactorGraph(), gtsam.Values(), []
    for n, (closest, measurement, T_ho_seen) in enumerate(window()):
        graph.push_back(build_graph(measurement, closest, X(n)))
        values.insert(X(n), T_ho_seen)
        seen.append(T_ho_seen)
        if n > 0:
            graph.push_back(gtsam.BetweenFactorPose3(X(n - 1), X(n), gtsam.Pose3(), HARDLY))
    smoothed = solve(graph, values)
    assert np.linalg.norm(seen[3].translation()) > 0.018
    for n in range(6):
        assert np.linalg.norm(smoothed.atPose3(X(n)).translation()) < 0.006
    marginal = gtsam.Marginals(graph, smoothed).marginalCovariance(X(5))
    alone = gtsam.Marginals(build_graph(measurement, closest, X(5)), one(X(5), seen[5]))
    assert np.trace(marginal) < np.trace(alone.marginalCovariance(X(5)))


def test_a_fixed_lag_smoother_ends_where_the_whole_window_does():
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setRelativeErrorTol(0.0)
    parameters.setAbsoluteErrorTol(0.0)
    smoother = gtsam.BatchFixedLagSmoother(10.0, parameters)  # [s], longer than the window
    short = gtsam.BatchFixedLagSmoother(0.25, parameters)
    whole, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for n, (closest, measurement, T_ho_seen) in enumerate(window(outlier=-1)):
        new, start = build_graph(measurement, closest, X(n)), gtsam.Values()
        if n > 0:
            new.push_back(gtsam.BetweenFactorPose3(X(n - 1), X(n), gtsam.Pose3(), HARDLY))
        start.insert(X(n), T_ho_seen)
        values.insert(X(n), T_ho_seen)
        whole.push_back(new)
        for each in (smoother, short):
            each.update(new, start, {X(n): measurement.time})
    expected = solve(whole, values).atPose3(X(5))
    assert smoother.calculateEstimatePose3(X(5)).equals(expected, 1e-5)
    assert sorted(short.calculateEstimate().keys()) == [X(n) for n in (3, 4, 5)]
    assert short.calculateEstimatePose3(X(5)).equals(expected, 1e-3)


OFFSET = 0.07  # [m], from one object's centre to the other's


def two_objects():
    """A lump at the hand's origin and a box beside it, in contact with 14 pads each; who touches whom is not said.

    Returns:
        PadSet, pad poses (28, 4, 4), and (key, field, true pose, pose seen) of each object.
    """
    objects, poses = [], []
    for key, sdf, x, seed in ((A(0), lump_sdf(10), 0.0, 10), (B(0), box_sdf(), OFFSET, 11)):
        T_true = gtsam.Pose3(gtsam.Rot3(), np.array([x, 0.0, 0.0]))
        pads, T_hp = pads_around(seed, count=40)
        T_hp[:, 0, 3] += x
        T_hp = T_hp[np.abs(T_hp[:, 0, 3] - OFFSET / 2) > 0.015][:14]  # none between the objects
        pads = PadSet(pads.pads[:14])
        T_hp = T_hp.copy()
        T_at = np.ascontiguousarray(T_true.matrix())
        for _ in range(3):  # along the pads' normals, until they touch
            found = ClosestPoints(pads, sdf).search(T_at, T_hp, np.ones(14, bool))
            T_hp[:, :3, 3] += found.distances[:, None] * T_hp[:, :3, 2]
        off = gtsam.Pose3.Expmap(np.array([0.03, -0.02, 0.03, 0.002, -0.002, 0.0015]))
        objects.append((key, sdf, T_true, T_true.compose(off)))
        poses.append(T_hp)
    pads, _ = pads_around(0, count=28)
    return pads, np.concatenate(poses), objects


def test_two_objects_in_one_hand_are_found_though_no_pad_says_which_it_touches():
    pads, T_hp, objects = two_objects()
    graph, start = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for key, sdf, _, T_seen in objects:
        measurement = Measurement(0.0, np.ones(28, bool), T_wp=T_hp, T_wo_visual=T_seen)
        graph.push_back(build_graph(measurement, ClosestPoints(pads, sdf), key))
        start.insert(key, T_seen)
    found = solve(graph, start)
    for (key, sdf, T_true, T_seen), own in zip(objects, (slice(14), slice(14, 28)), strict=True):
        T = found.atPose3(key)
        error = np.linalg.norm(T_true.between(T).translation())
        assert error < 0.4 * np.linalg.norm(T_true.between(T_seen).translation())
        touching = np.ones(28, bool)
        gaps = ClosestPoints(pads, sdf).search(
            np.ascontiguousarray(T.matrix()), np.ascontiguousarray(T_hp), touching
        )
        weights = np.exp(-(1e6 * np.maximum(gaps.distances, 0) ** 2) / np.exp(3.4))
        assert (weights[own] > 0.9).all()  # its own pads are on it
        others = np.ones(28, bool)
        others[own] = False
        assert (weights[others] < 0.1).all()  # the other one's are let go
