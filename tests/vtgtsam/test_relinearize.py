# SPDX-License-Identifier: MIT
"""A frame solved again with its hand linearized ends where solving it anew ends, where that is near."""

import gtsam
import numpy as np
import pytest
from lump_grasp import SEEN, grasp

from vtgtsam import EstimatorConfig, PoseEstimator
from vtgtsam.estimator import _past
from vtgtsam.relinearize import NEAR, solved_again


class Bench:
    """An estimator after a while, and its last frame, in which nothing was seen."""

    def __init__(self):
        pads, obj, frames, _ = grasp(count=30)
        self.config = EstimatorConfig(pad_sigma=0.0, camera_sigma=(0.0, 0.0))
        self.estimator = PoseEstimator(pads, obj, self.config)
        for frame in frames:
            self.estimator.update(frame)
        self.past = self.anew(self.unseen(self.estimator._history._past[-1]))
        self.linearized = 0  # how often the hand was
        self.prior = self.estimator._calibration_prior(self.past.frame)

    @staticmethod
    def unseen(past):
        return past._replace(frame=past.frame._replace(T_ho_visual=None, visual_covariance=None))

    def seen(self, T_ho):
        covariance = np.diag(np.repeat(np.square(SEEN), 3))
        frame = self.past.frame
        frame = frame._replace(T_ho_visual=T_ho, visual_covariance=covariance)
        return self.past._replace(frame=frame)

    def anew(self, past, before=None):
        before = past.before if before is None else before
        solved = self.estimator._step(past.frame, past.mode, before)
        self.weight = solved.fit.visual_weight
        return _past(past.frame, past.mode, before, solved)

    def again(self, past, before=None):
        before = past.before if before is None else before
        return solved_again(past, before, self.prior, self.config, self.linearize)

    def linearize(self, *arguments):
        self.linearized += 1
        return self.estimator._solver.linearized_hand(*arguments)

    def elsewhere(self, size):
        step = size * np.array([2.0, -1.0, 1.0, 0.3, -0.5, 0.4])  # [rad], [m]
        before = self.past.before
        seen = before.seen._replace(T_ho=before.seen.T_ho.retract(step))
        return before._replace(T_ho=before.T_ho.retract(step), seen=seen)


@pytest.fixture
def bench():
    return Bench()


def apart(one, other):
    return np.linalg.norm(gtsam.Pose3.Logmap(one.T_ho.between(other.T_ho)))


@pytest.mark.parametrize(
    ("size", "share"),
    [
        (1e-6, 0.005),  # linear
        (1e-4, 0.15),  # other pads are pressed
    ],
)
def test_it_ends_where_solving_ends(bench, size, share):
    before = bench.elsewhere(size)
    found, _ = bench.again(bench.past, before)
    expected = bench.anew(bench.past, before)
    step = apart(expected.after, bench.past.after)
    assert step > size  # there was a way to go
    assert apart(found.after, expected.after) < share * step
    known = expected.after.knowledge.information
    off = found.after.knowledge.information - known
    assert np.abs(off).max() < share * np.abs(known).max()
    assert found.before == before and bench.linearized == 0


def test_twice_is_as_good_as_once(bench):
    """The hand stays linearized where it was solved, wherever the frame has gone meanwhile."""
    first, _ = bench.again(bench.past, bench.elsewhere(5e-4))
    found, _ = bench.again(first, bench.past.before)
    assert apart(first.after, bench.past.after) > 1e-4
    assert apart(found.after, bench.past.after) < 1e-7


def test_a_visual_pose_that_is_new_counts_as_in_a_frame_that_is_solved(bench):
    T_ho = bench.past.after.T_ho.retract(np.array([1e-3, 0, 0, 0, 1e-4, 0]))
    before = bench.past.before._replace(seen=None)  # or it would be compared with this pose
    found, weight = bench.again(bench.seen(T_ho), before)
    expected = bench.anew(bench.seen(T_ho), before)
    assert apart(expected.after, bench.past.after) > 1e-5
    assert apart(found.after, expected.after) < 0.1 * apart(expected.after, bench.past.after)
    assert weight == pytest.approx(bench.weight, abs=1e-3)
    np.testing.assert_allclose(
        found.after.knowledge.information, expected.after.knowledge.information, rtol=0.05, atol=1e3
    )


def test_far_away_the_hand_is_linearized_anew(bench):
    before = bench.elsewhere(3.0 * NEAR)
    found, _ = bench.again(bench.past, before)
    expected = bench.anew(bench.past, before)
    assert bench.linearized == 1
    assert apart(found.after, expected.after) < 0.1 * apart(expected.after, bench.past.after)


def test_where_vision_may_take_over_a_frame_is_solved_anew(bench):
    away = bench.past.after.T_ho.compose(gtsam.Pose3(gtsam.Rot3(), np.array([0.0, 0.0, 0.2])))
    refused = bench.past.before._replace(refused_since=bench.past.frame.time - 0.1)
    assert bench.again(bench.seen(away), refused) is not None
    refused = refused._replace(refused_since=bench.past.frame.time - 2 * bench.config.restart_after)
    assert bench.again(bench.seen(away), refused) is None
