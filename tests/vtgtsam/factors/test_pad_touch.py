# SPDX-License-Identifier: MIT
"""The self-touch factor: two pads of a hand that touch each other."""

import gtsam
import numpy as np
import pytest
from jacobians import assert_jacobian_matches

from vtgtsam import load_hand
from vtgtsam.factors.pad_touch import face_distance, pad_gap, touch_factor, touch_residual
from vtgtsam.grasp import load_grasp
from vtgtsam.grasp.self_touch import plan_touches

SIZE = np.array([0.02, 0.01])


@pytest.fixture(scope="module")
def hand():
    return load_hand("isyhand")


@pytest.fixture(scope="module")
def touches(hand):
    return plan_touches(hand, load_grasp("isyhand"), count=6)


def values_at(zeros):
    values = gtsam.Values()
    values.insert(0, zeros)
    return values


def test_distances_to_a_face():
    points = np.array(
        [[0, 0, 0.003], [0.004, 0.002, -0.004], [0.013, 0, 0], [0.013, 0.009, 0], [0.013, 0, 0.004]]
    )
    distances, gradients = face_distance(points, SIZE)
    np.testing.assert_allclose(distances, [0.003, -0.004, 0.003, 0.005, 0.005], atol=1e-15)
    np.testing.assert_allclose(gradients[:3], [[0, 0, 1], [0, 0, 1], [1, 0, 0]], atol=1e-15)
    np.testing.assert_allclose(gradients[3:], [[0.6, 0.8, 0], [0.6, 0, 0.8]], atol=1e-12)


def test_planned_touches_are_touches(hand, touches):
    assert len(touches) == 6
    for touch in touches:
        assert "thumb" in hand.pad_names[touch.a] and "thumb" not in hand.pad_names[touch.b]
        gaps = [
            pad_gap(hand, hand.pad_transforms(touch.at(wanted)), touch.a, touch.b).distance
            for wanted in (-0.002, 0.0, 0.004)
        ]
        assert gaps[0] < -0.0005 and abs(gaps[1]) < 2e-4 and gaps[2] > 0.001


def test_it_does_not_matter_which_pad_is_named_first(hand, touches):
    joints, none = touches[0].joints, np.zeros(len(hand.joint_names))
    a, b = touches[0].a, touches[0].b
    one, other = (touch_residual(hand, joints, none, *pair) for pair in ((a, b), (b, a)))
    assert one[0] == other[0]
    np.testing.assert_array_equal(one[1], other[1])


@pytest.mark.parametrize("seed", range(6))
def test_the_jacobian_matches_finite_differences(hand, touches, seed):
    touch = touches[seed]
    zeros = np.random.default_rng(seed).normal(0, 0.02, len(hand.joint_names))
    noise = gtsam.noiseModel.Unit.Create(1)
    factor = touch_factor(0, hand, touch.joints, touch.a, touch.b, 0.0004, noise)
    assert_jacobian_matches(factor, values_at(zeros), step=1e-8, atol=1e-5)


def test_joints_that_move_neither_pad_do_not_matter(hand, touches):
    touch = touches[0]
    _, row = touch_residual(hand, touch.joints, np.zeros(len(touch.joints)), touch.a, touch.b)
    moving = hand.moves_pads[[touch.a, touch.b]].any(axis=0)
    assert (row[~moving] == 0.0).all() and np.abs(row[moving]).max() > 0.01


def solved(hand, touches, true):
    """Zeros from touches as a robot of these makes them, beside a prior of a degree."""
    count = len(hand.joint_names)
    graph = gtsam.NonlinearFactorGraph()
    prior = gtsam.noiseModel.Isotropic.Sigma(count, np.deg2rad(1.0))
    graph.push_back(gtsam.PriorFactorVector(0, np.zeros(count), prior))
    noise = gtsam.noiseModel.Isotropic.Sigma(1, 0.0004)
    for touch in touches:
        gap = touch_residual(hand, touch.joints, np.zeros(count), touch.a, touch.b)[0]
        measured = touch.joints + true
        graph.push_back(touch_factor(0, hand, measured, touch.a, touch.b, gap, noise))
    return (
        gtsam.LevenbergMarquardtOptimizer(graph, values_at(np.zeros(count))).optimize().atVector(0)
    )


def test_zeros_are_nearer_to_the_truth_after_touches(hand, touches):
    rng = np.random.default_rng(3)
    before, after = [], []
    for _ in range(8):
        true = rng.normal(0, np.deg2rad(1.0), len(hand.joint_names))
        before.append(np.square(true).sum())
        after.append(np.square(solved(hand, touches, true) - true).sum())
    assert np.mean(after) < 0.85 * np.mean(before)
