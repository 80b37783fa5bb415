# SPDX-License-Identifier: MIT
"""All solvers minimise the same objective and take the same steps."""

import numpy as np
import pytest

from benchmarks import problems
from benchmarks.ours import Ours
from benchmarks.reference import Reference
from benchmarks.theseus_process import TheseusProcess, absent
from vtgtsam import Pad

needs_theseus = pytest.mark.skipif(bool(absent()), reason=absent())
SETTINGS = {"w_vis": np.array([0.3, 2.0]), "w_tac": 3.0, "w_pen": 5.0, "log_theta_tac": -3.0}
VARIANTS = {
    "own": {},
    "bare": {"lie": "bare"},
    "gathers": {"lie": "bare", "sampler": "gathers"},
    "autodiff": {"kind": "autodiff"},
    "autodiff a pad": {"kind": "autodiff", "stacked": False},
}


@pytest.fixture(scope="module")
def problem():
    """Pads of two sizes, not in order, some of them beyond the grid; every weight and loss its own."""
    sizes = [(0.014, 0.018), (0.02, 0.02), (0.014, 0.018), (0.03, 0.01), (0.02, 0.02)]
    pads = [Pad(f"pad_{k}", size) for k, size in enumerate(sizes)]
    found = problems.single_frames(6, seed=3, pads=pads, sdf=problems.lump(48), **SETTINGS)
    found.T_wp[:, 1, :3, 3] += 0.1  # [m], off the grid
    return found


def assert_same_objective(solver, reference, problem, rtol):
    for n in range(problem.frames):
        ours, expected = (
            solver.linearise(n, problem.T_start[n]),
            reference.linearise(n, problem.T_start[n]),
        )
        np.testing.assert_allclose(ours.cost, expected.cost, rtol=rtol)
        for name in ("information", "gradient"):
            want = getattr(expected, name)
            np.testing.assert_allclose(
                getattr(ours, name), want, rtol=0, atol=rtol * np.abs(want).max()
            )


def assert_same_steps(solver, reference, problem, atol):
    for n in range(problem.frames):
        start = problem.T_start[n : n + 1]
        solved, expected = solver.solve(n, start), reference.solve(n, start)
        np.testing.assert_allclose(solved.T_wo, expected.T_wo, rtol=0, atol=atol)
        assert solved.time.cpu > 0


def test_ours_has_the_references_objective_and_steps(problem):
    reference = Reference(problem)
    solver = Ours(problem, "fixed-damping")
    # 1e-8: the reference differentiates the visual term numerically
    assert_same_objective(solver, reference, problem, rtol=1e-8)
    assert_same_steps(solver, reference, problem, atol=2e-8)


@needs_theseus
@pytest.mark.parametrize(
    "variant",
    [
        pytest.param(name, marks=[pytest.mark.slow] if "autodiff" in name else [])
        for name in VARIANTS
    ],
)
def test_theseus_has_the_references_objective_and_steps(problem, variant):
    reference = Reference(problem)
    solver = TheseusProcess(problem, variant, dtype="float64", **VARIANTS[variant])
    try:
        assert_same_objective(solver, reference, problem, rtol=1e-8)
        assert_same_steps(solver, reference, problem, atol=2e-8)
    finally:
        solver.close()


@needs_theseus
def test_a_batch_gives_what_its_frames_give_alone_also_in_single_precision(problem):
    solver = TheseusProcess(problem, "float32", lie="bare")
    together = solver.solve(0, problem.T_start, batch=problem.frames).T_wo
    alone = [solver.solve(n, problem.T_start[n : n + 1]).T_wo[0] for n in range(problem.frames)]
    solver.close()
    np.testing.assert_allclose(together, alone, atol=1e-5)  # a few steps of float32 rounding


@needs_theseus
def test_far_starts_take_theseus_own_logarithm(problem):
    from benchmarks.motion import exp_se3

    reference = Reference(problem)
    solver = TheseusProcess(problem, "bare", dtype="float64", lie="bare")
    far = problem.T_start[0] @ exp_se3(np.array([0.7, -0.4, 0.5, 0, 0, 0]))
    ours, expected = solver.linearise(0, far), reference.linearise(0, far)
    solver.close()
    np.testing.assert_allclose(ours.cost, expected.cost, rtol=1e-8)
    np.testing.assert_allclose(ours.gradient, expected.gradient, atol=1e-8)


@needs_theseus
def test_what_fails_in_the_other_process_is_told_here(problem):
    solver = TheseusProcess(problem, "own")
    with pytest.raises(RuntimeError, match="own failed: .*"):
        solver.solve(0, np.zeros((1, 3, 3)))


def test_where_the_environment_is_absent_one_sentence_says_how_to_build_it(monkeypatch, tmp_path):
    monkeypatch.setenv("VTGTSAM_THESEUS", str(tmp_path))
    assert "make theseus" in absent()
