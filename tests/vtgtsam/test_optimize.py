# SPDX-License-Identifier: MIT
import gtsam
import numpy as np
import pytest
from problems import alone, as_reference, frame

from vtgtsam import EstimatorConfig
from vtgtsam.graph import build_graph
from vtgtsam.optimize import fixed_damping, levenberg_marquardt, optimize
from vtgtsam.sdf.search import ClosestPoints

KEY = 3


def problem(seed, config):
    """Graph, start and independent implementation of one random frame."""
    pads, obj, measurement, start = frame(seed)
    graph = build_graph(measurement, ClosestPoints(pads, obj.sdf), KEY, config)
    values = gtsam.Values()
    values.insert(KEY, gtsam.Pose3(start))
    return graph, values, as_reference(pads, obj, measurement, config)


@pytest.mark.parametrize("seed", range(5))
def test_fixed_damping_takes_the_independent_implementations_steps(seed):
    config = alone()
    graph, start, reference = problem(seed, config)
    for iterations in (1, 2, 5):
        solution = fixed_damping(graph, start, 300.0, iterations)
        expected = reference.fixed_damping(start.atPose3(KEY).matrix(), iterations, 300.0)
        np.testing.assert_allclose(solution.values.atPose3(KEY).matrix(), expected, atol=1e-6)
        assert solution.iterations == iterations
        assert solution.error == pytest.approx(reference.cost(expected), rel=1e-6)


@pytest.mark.parametrize("seed", range(10))
def test_levenberg_marquardt_lowers_the_cost_step_by_step(seed):
    graph, start, _ = problem(seed, EstimatorConfig.simulation())
    errors = [graph.error(start)]
    for iterations in range(1, 8):
        solution = levenberg_marquardt(graph, start, 0.02, iterations)
        assert solution.iterations <= iterations
        assert solution.error == pytest.approx(graph.error(solution.values), rel=1e-12)
        errors.append(solution.error)
    assert (np.diff(errors) <= 0).all() and errors[-1] < errors[0]


def test_small_costs_do_not_stop_it_early():
    """With weights of one a cost is in squared metres; GTSAM's default tolerances stop at 1e-5 of them."""
    goal = gtsam.Pose3(gtsam.Rot3.Rx(0.01), np.array([0.004, 0.0, 0.0]))
    noise = gtsam.noiseModel.Isotropic.Sigma(6, 1.0)
    graph = gtsam.NonlinearFactorGraph()
    graph.push_back(gtsam.PriorFactorPose3(KEY, goal, noise))
    start = gtsam.Values()
    start.insert(KEY, gtsam.Pose3())
    found = levenberg_marquardt(graph, start, 1.0, 20).values.atPose3(KEY)
    assert found.equals(goal, 1e-7)


def test_the_configuration_chooses_the_solver():
    config = alone(solver="fixed-damping", iterations=3, damping=50.0)
    graph, start, _ = problem(0, config)
    by_steps, by_config = fixed_damping(graph, start, 50.0, 3), optimize(graph, start, config)
    assert by_config.values.equals(by_steps.values, 0.0) and by_config.iterations == 3
    by_lm = optimize(graph, start, config.model_copy(update={"solver": "lm"}))
    assert by_lm.values.equals(levenberg_marquardt(graph, start, 50.0, 3).values, 0.0)
    assert not by_lm.values.equals(by_steps.values, 1e-9)


def test_a_step_that_is_not_finite_ends_the_steps():
    noise = gtsam.noiseModel.Isotropic.Sigma(6, 1e-300)
    graph = gtsam.NonlinearFactorGraph()
    graph.push_back(gtsam.PriorFactorPose3(KEY, gtsam.Pose3(), noise))
    start = gtsam.Values()
    start.insert(KEY, gtsam.Pose3(gtsam.Rot3.Rx(0.1), np.zeros(3)))
    solution = fixed_damping(graph, start, 1.0, 5)
    assert solution.iterations == 0 and solution.values.equals(start, 0.0)


def test_fixed_damping_damps_every_variable_of_a_graph():
    noise = gtsam.noiseModel.Isotropic.Sigma(6, 1.0)
    goal, graph, start = (
        gtsam.Pose3(gtsam.Rot3(), np.ones(3)),
        gtsam.NonlinearFactorGraph(),
        gtsam.Values(),
    )
    for key in (1, 2):
        graph.push_back(gtsam.PriorFactorPose3(key, goal, noise))
        start.insert(key, gtsam.Pose3())
    values = fixed_damping(graph, start, 3.0, 1).values
    for key in (1, 2):
        np.testing.assert_allclose(values.atPose3(key).translation(), np.full(3, 0.25), atol=1e-12)
