# SPDX-License-Identifier: MIT
"""Whether a grasp agrees with the others, on problems that are linear and whose errors are known."""

import numpy as np

from vtgtsam.calibration.consistency import nees
from vtgtsam.calibration.directions import directions

SIZE = 8


def linear_grasps(rng, count=4, rows=5):
    """Posterior covariance and, of each grasp, H and eta at the solution, of a problem with unit noise and prior."""
    true = rng.normal(size=SIZE)
    A = rng.normal(size=(count, rows, SIZE))
    y = A @ true + rng.normal(size=(count, rows))
    H = np.einsum("gri,grj->gij", A, A)
    covariance = np.linalg.inv(np.eye(SIZE) + H.sum(axis=0))
    solution = covariance @ np.einsum("gri,gr->i", A, y)
    eta = np.einsum("gri,gr->gi", A, y - A @ solution)
    return covariance, H, eta


def test_grasps_of_one_robot_are_one_sigma_apart():
    rng = np.random.default_rng(0)
    found = []
    for _ in range(300):
        covariance, H, eta = linear_grasps(rng)
        found += [nees(H[g], eta[g], covariance) for g in range(len(H))]
    assert abs(np.mean(found) - 1.0) < 0.08


def test_a_grasp_of_another_robot_stands_out():
    rng = np.random.default_rng(1)
    covariance, H, eta = linear_grasps(rng)
    assert nees(H[0], eta[0] + 20 * H[0] @ rng.normal(size=SIZE), covariance) > 20


def test_a_grasp_that_sees_nothing_cannot_disagree():
    assert nees(np.zeros((3, 3)), np.zeros(3), np.eye(3)) == 0.0


def test_what_contacts_see_as_a_sum_leaves_the_difference():
    before = np.diag([4.0, 4.0, 1.0])
    A = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 3.0]])
    covariance = np.linalg.inv(np.linalg.inv(before) + A.T @ A)
    least, middle, best = directions(covariance, before)
    assert least.left == 1.0 or abs(least.left - 1.0) < 1e-9
    np.testing.assert_allclose(np.abs(least.components), [np.sqrt(0.5), np.sqrt(0.5), 0], atol=1e-9)
    assert least.components[0] * least.components[1] < 0
    assert middle.left > best.left
