# SPDX-License-Identifier: MIT
"""A frame from another belief before it: by its linearized factors as by solving it, where that is near."""

import gtsam
import numpy as np
import pytest
from lump_grasp import grasp

from vtgtsam import EstimatorConfig, PoseEstimator
from vtgtsam.relinearize import NEAR, moved


@pytest.fixture
def held():
    """An estimator after a while, and its last frame, which only touch speaks in."""
    pads, obj, frames, _ = grasp(count=30)
    estimator = PoseEstimator(pads, obj, EstimatorConfig(pad_sigma=0.0, camera_sigma=(0.0, 0.0)))
    for frame in frames:
        estimator.update(frame)
    past = estimator._history._past[-1]
    unseen = past.frame._replace(T_ho_visual=None, visual_covariance=None)
    solved = estimator._step(unseen, past.mode, past.before)
    return estimator, past._replace(frame=unseen, after=solved.belief, says=solved.information)


def elsewhere(belief, size):
    step = size * np.array([2.0, -1.0, 1.0, 0.3, -0.5, 0.4])  # [rad], [m]
    return belief._replace(T_ho=belief.T_ho.retract(step))


@pytest.mark.parametrize(
    ("size", "share"),
    [
        (1e-5, 0.002),  # linear
        (1e-3, 0.15),  # other pads are pressed
    ],
)
def test_it_ends_where_solving_ends(held, size, share):
    estimator, past = held
    before = elsewhere(past.before, size)
    found = moved(past, before, estimator.config)
    expected = estimator._step(past.frame, past.mode, before).belief
    step = gtsam.Pose3.Logmap(past.after.T_ho.between(expected.T_ho))
    off = gtsam.Pose3.Logmap(found.after.T_ho.between(expected.T_ho))
    assert np.linalg.norm(step) > size  # there was a way to go
    assert np.linalg.norm(off) < share * np.linalg.norm(step)
    known = expected.knowledge.information
    off = found.after.knowledge.information - known
    assert np.abs(off).max() < share * np.abs(known).max()
    assert found.before == before


def test_from_the_same_belief_it_stays_where_it_is(held):
    estimator, past = held
    found = moved(past, past.before, estimator.config)
    off = gtsam.Pose3.Logmap(past.after.T_ho.between(found.after.T_ho))
    assert np.linalg.norm(off) < 1e-7


def test_far_away_a_frame_is_solved_anew(held):
    estimator, past = held
    before = elsewhere(past.before, 5.0 * NEAR)
    stubborn = before._replace(
        knowledge=before.knowledge._replace(information=1e9 * before.knowledge.information)
    )
    assert moved(past, stubborn, estimator.config) is None


def test_how_much_vision_counts_is_found_anew(held):
    estimator, past = held
    seen = past._replace(frame=past.frame._replace(T_ho_visual=past.after.T_ho))
    assert moved(seen, past.before, estimator.config) is None
