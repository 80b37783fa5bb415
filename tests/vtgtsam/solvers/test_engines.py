# SPDX-License-Identifier: MIT
"""Compiled steps end where GTSAM's own optimisers end, over the factor graph of the same frame."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest
from problems import as_reference, ball_sdf, box_sdf, frame, lump_sdf
from reference import exp_se3

from vtgtsam import EstimatorConfig, PoseEstimator
from vtgtsam.frame import check
from vtgtsam.objective import Objective, cost, linearize
from vtgtsam.solvers.graph import OBJECT, GraphBuilder
from vtgtsam.solvers.steps import damped_step, promise

PRESETS = {
    "simulation": EstimatorConfig.simulation(),
    "real world": EstimatorConfig.real_world(),
    "tuned": EstimatorConfig.tuned(),
    "no contacts": EstimatorConfig.tuned(method="vis+pen"),
    "ten iterations": EstimatorConfig.tuned(iterations=10),
    "strong damping": EstimatorConfig.tuned(damping=1e7),
    "little damping": EstimatorConfig.simulation(damping=1e-3),
    "a loss that bends": EstimatorConfig.tuned(log_theta_vis=-1.0, log_theta_tac=-2.0),
}
FIELDS = (lump_sdf(0), box_sdf(), ball_sdf())


def estimates(config, measurements, pads, obj, start):
    """What each engine makes of the frames, each frame from the same start."""
    for engine in ("compiled", "gtsam"):
        estimator = PoseEstimator(pads, obj, config.model_copy(update={"engine": engine}))
        found = []
        for measurement in measurements:
            estimator.reset(gtsam.Pose3(start))
            found.append(estimator.update(measurement))
        yield found


@pytest.mark.parametrize("solver", ["lm", "fixed-damping"])
@pytest.mark.parametrize("preset", PRESETS)
def test_both_engines_find_the_same(preset, solver):
    config = PRESETS[preset].model_copy(update={"solver": solver})
    for seed in range(12):
        pads, obj, measurement, start = frame(seed, FIELDS[seed % 3])
        frames = [
            measurement,
            replace(measurement, T_wo_visual=None),
            replace(measurement, T_wo_visual=gtsam.Pose3(start)),  # no visual residual at the start
            replace(measurement, contacts=np.zeros(8, bool)),
            replace(measurement, visual_sigma=(0.02, 0.004)),
        ]
        compiled, by_gtsam = estimates(config, frames, pads, obj, start)
        for a, b in zip(compiled, by_gtsam, strict=True):
            np.testing.assert_allclose(a.T_wo.matrix(), b.T_wo.matrix(), atol=1e-8)
            assert a.error == pytest.approx(b.error, rel=1e-6, abs=1e-10)
            assert a.status == b.status
            assert (
                abs(a.iterations - b.iterations) <= 1
            )  # a step too small to matter may be refused


@pytest.mark.parametrize("preset", PRESETS)
def test_the_graph_has_the_compiled_cost_and_linearization(preset):
    config = PRESETS[preset]
    for seed in range(6):
        pads, obj, measurement, start = frame(seed, FIELDS[seed % 3])
        objective = Objective(pads, obj, config)
        checked = check(measurement, pads)
        objective.place(checked)
        graph = GraphBuilder(objective.hand, config).build(checked)
        values = gtsam.Values()
        values.insert(OBJECT, gtsam.Pose3(start))
        assert cost(start, *objective.tables) == pytest.approx(graph.error(values), rel=1e-12)
        H, b = np.empty((6, 6)), np.empty(6)
        linearize(start, *objective.tables, H, b)
        expected_H, expected_b = graph.linearize(values).hessian()
        np.testing.assert_allclose(H, expected_H, atol=1e-11 * np.abs(expected_H).max())
        np.testing.assert_allclose(b, expected_b, atol=1e-11 * np.abs(expected_b).max())


def test_a_damped_step_solves_its_system_and_keeps_its_promise():
    rng = np.random.default_rng(0)
    for rank in (2, 6, 6, 6):
        J, r = rng.normal(size=(rank, 6)), rng.normal(size=rank)
        H, b, step = J.T @ J, -J.T @ r, np.empty(6)
        assert damped_step(H, b, 0.3, step)
        np.testing.assert_allclose((H + 0.3 * np.eye(6)) @ step, b, atol=1e-10)
        promised = 0.5 * (r @ r) - 0.5 * np.sum((J @ step + r) ** 2)
        assert promise(H, 0.3, step) == pytest.approx(promised, rel=1e-9)


def test_a_system_without_a_solution_gives_no_step():
    step = np.empty(6)
    assert not damped_step(np.zeros((6, 6)), np.ones(6), 0.0, step)
    assert not damped_step(np.full((6, 6), np.nan), np.ones(6), 1.0, step)


def test_a_start_far_from_everything_ends():
    pads, obj, measurement, start = frame(3)
    far = start @ exp_se3(np.array([1.0, -2.0, 0.5, 3.0, 1.0, -2.0]))
    for solver in ("lm", "fixed-damping"):
        config = EstimatorConfig.tuned(solver=solver, recover=False)
        compiled, by_gtsam = estimates(config, [measurement], pads, obj, far)
        assert compiled[0].status == by_gtsam[0].status
        np.testing.assert_allclose(compiled[0].T_wo.matrix(), by_gtsam[0].T_wo.matrix(), atol=1e-6)


def test_at_a_minimum_no_step_is_taken():
    pads, obj, measurement, start = frame(4)
    config = EstimatorConfig.tuned(iterations=100)
    estimator = PoseEstimator(pads, obj, config)
    estimator.reset(gtsam.Pose3(start))
    T_wo = estimator.update(measurement).T_wo
    problem = as_reference(pads, obj, measurement, config)
    again = estimator.update(measurement)
    assert again.error <= problem.cost(T_wo.matrix()) * (1 + 1e-12)
    np.testing.assert_allclose(again.T_wo.matrix(), T_wo.matrix(), atol=1e-6)
