# SPDX-License-Identifier: MIT
"""NEES and coverage: right for covariances that are right, and blind to what looks the same."""

import gtsam
import numpy as np
import pandas as pd
import pytest

from vtgtsam.evaluation.consistency import covered, nees
from vtgtsam.evaluation.statistics import sequence_statistics
from vtgtsam.shapes.symmetry import BOX, REVOLUTION, SPHERE

T_TRUE = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.4, -0.3, 0.8), np.array([0.1, -0.2, 0.5]))
SIGMAS = np.array([0.02, 0.03, 0.05, 0.001, 0.002, 0.003])
COUNT = 4000


def drawn(scale=1.0, count=COUNT, T_true=T_TRUE):
    """Estimates whose errors have that scale of what the covariances say."""
    rng = np.random.default_rng(0)
    A = rng.normal(size=(6, 6))
    S = np.diag(SIGMAS) @ (A @ A.T / 6 + np.eye(6)) @ np.diag(SIGMAS)
    xi = scale * rng.multivariate_normal(np.zeros(6), S, size=count)
    estimates = [T_true.compose(gtsam.Pose3.Expmap(-x)) for x in xi]
    return estimates, np.tile(S, (count, 1, 1)), [T_true] * count


def test_a_right_covariance_gives_one_and_covers_as_often_as_it_promises():
    values, dof = nees(*drawn())
    assert values.mean() == pytest.approx(1.0, abs=0.03) and set(dof) == {6}
    for level in (0.5, 0.8, 0.95):
        assert covered(values, dof, level).mean() == pytest.approx(level, abs=0.02)


def test_twice_the_error_gives_four_and_covers_less():
    values, dof = nees(*drawn(scale=2.0))
    assert values.mean() == pytest.approx(4.0, abs=0.15)
    assert covered(values, dof, 0.95).mean() < 0.5


def test_the_error_is_measured_in_the_estimates_frame():
    T_est = gtsam.Pose3(gtsam.Rot3.Rz(np.pi / 2), np.zeros(3))
    T_true = gtsam.Pose3(gtsam.Rot3.Rz(np.pi / 2), np.array([0.01, 0.0, 0.0]))  # its -y
    S = np.diag([1.0, 1.0, 1.0, 1.0, 0.01**2, 1.0])
    values, _ = nees([T_est], S[None], [T_true])
    assert values[0] == pytest.approx(1 / 6)


def test_directions_that_nothing_measures_do_not_count():
    estimates, S, truths = drawn()
    S[:, :, 2] = S[:, 2, :] = 0.0
    S[:, 2, 2] = np.inf
    values, dof = nees(estimates, S, truths)
    assert set(dof) == {5} and np.isfinite(values).all()
    nothing = np.full((1, 6, 6), np.inf)
    values, dof = nees(estimates[:1], nothing, truths[:1])
    assert np.isnan(values[0]) and dof[0] == 0 and not covered(values, dof, 0.95)[0]


@pytest.mark.parametrize(
    "symmetry, turn",
    [
        (BOX, gtsam.Rot3.Rx(np.pi)),
        (REVOLUTION, gtsam.Rot3.Rz(2.0)),
        (SPHERE, gtsam.Rot3.RzRyRx(1.0, 2.0, -0.5)),
    ],
)
def test_a_pose_that_looks_the_same_is_as_good(symmetry, turn):
    estimates, S, truths = drawn(scale=0.3, count=50)
    turned = [T.compose(gtsam.Pose3(turn, np.zeros(3))) for T in truths]
    same, dof = nees(estimates, S, truths, symmetry)
    again, _ = nees(estimates, S, turned, symmetry)
    np.testing.assert_allclose(again, same, rtol=1e-6)
    assert set(dof) == {6 if symmetry is BOX else 5 if symmetry is REVOLUTION else 3}
    assert nees(estimates, S, turned)[0].min() > 100  # without the symmetry they are wrong


def test_about_an_axis_beside_the_origin_too():
    offset = {"symmetries_continuous": [{"axis": [0, 0, 1], "offset": [20, 0, 0]}]}
    point = np.array([0.02, 0.0, 0.0])
    about = gtsam.Pose3(gtsam.Rot3(), point)
    turn = about.compose(gtsam.Pose3(gtsam.Rot3.Rz(1.3), np.zeros(3))).compose(about.inverse())
    S = np.diag(np.square(SIGMAS))[None]
    values, _ = nees([T_TRUE.compose(turn)], S, [T_TRUE], offset)
    assert values[0] < 1e-12


def test_a_free_axis_leaves_a_right_covariance_right():
    values, dof = nees(*drawn(), REVOLUTION)
    assert values.mean() == pytest.approx(1.0, abs=0.05)
    assert covered(values, dof, 0.95).mean() == pytest.approx(0.95, abs=0.02)


def metrics(**columns):
    count = 10
    table = {
        "sequence": "s", "object": "o", "dataset": "vary", "method": "vis", "phase": "after", "status": "ok",
        "adds_m": 0.001, "add_m": 0.001, "translation_m": 0.001, "rotation_rad": 0.01,
    }  # fmt: skip
    return pd.DataFrame({name: [value] * count for name, value in (table | columns).items()})


def test_a_sequence_counts_the_frames_that_its_regions_hold():
    row = sequence_statistics(metrics(nees=2.0, nees_dof=6))[0]  # 12.0, and 12.59 bounds 95 %
    assert row["nees"] == 2.0 and row["frames_with_covariance"] == 10
    assert (row["frames_in_50"], row["frames_in_80"], row["frames_in_95"]) == (0, 0, 10)


def test_results_from_before_covariances_were_judged_stay_readable():
    row = sequence_statistics(metrics())[0]
    assert row["frames_with_covariance"] == 0 and np.isnan(row["nees"])
