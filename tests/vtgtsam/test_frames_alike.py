# SPDX-License-Identifier: MIT
"""Frames that err alike count as one: memory does not take from many what one of them knows."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest
from lump_grasp import PERIOD, SEEN, errors, grasp, run

from vtgtsam import EstimatorConfig, Measurement
from vtgtsam.frame import check
from vtgtsam.hands.pads import Pad, PadSet
from vtgtsam.knowledge import FrameInformation, Knowledge
from vtgtsam.memory import Belief, expectation, frames_alike

LASTING = 20.0  # [s]
NO_TOUCH = {"w_tac": 1e2, "w_pen": 1e2}  # 10 cm: it is vision that tells
SIGMA = (3 * SEEN[0], 3 * SEEN[1])  # [rad], [m]


def seen_with(frames, truth, errors_o, correlation):
    """The frames with visual poses of these errors (N, 6)."""
    return [
        replace(
            frame, T_wo_visual=T.retract(xi), visual_sigma=SIGMA, visual_correlation=correlation
        )
        for frame, T, xi in zip(frames, truth, errors_o, strict=True)
    ]


def staying(rng, count, lasting):
    """Errors (count, 6) of SIGMA with autocorrelation exp(-t / lasting)."""
    kept = np.exp(-PERIOD / lasting)
    fresh = np.sqrt(1.0 - kept**2) * rng.normal(size=(count, 6))
    found = [rng.normal(size=6)]
    for step in fresh[1:]:
        found.append(kept * found[-1] + step)
    return np.array(found) * np.repeat(SIGMA, 3)


def nees_at_the_end(correlation, grasps=20):
    """NEES a degree of freedom after 3 s in which a held object is seen with errors that stay."""
    found = []
    for seed in range(grasps):
        pads, obj, frames, truth = grasp(count=90, seed=seed)
        wrong = staying(np.random.default_rng(seed), 90, lasting=LASTING / 2)
        estimate = run(pads, obj, seen_with(frames, truth, wrong, correlation), **NO_TOUCH)[-1]
        xi = estimate.T_wo.localCoordinates(truth[-1])
        found.append(xi @ np.linalg.solve(estimate.covariance, xi) / 6.0)
    return np.mean(found)


def test_the_covariance_holds_where_errors_stay_and_would_not_if_nobody_said_so():
    assert 0.6 < nees_at_the_end(LASTING) < 1.5
    assert nees_at_the_end(0.0) > 3.0


def test_an_object_that_leaves_the_hand_is_followed_all_the_same():
    pads, obj, frames, truth = grasp(count=60, away=0.1)
    for n in range(30, 60):
        away = gtsam.Pose3(gtsam.Rot3(), np.array([0.0, 0.0, 0.002 * (n - 30)]))
        truth[n] = truth[n].compose(away)
        frames[n] = replace(frames[n], contacts=np.zeros(12, bool))
    estimates = run(pads, obj, seen_with(frames, truth, np.zeros((60, 6)), LASTING))
    # A tracker of 6 mm, and 6 cm/s.
    assert errors(estimates, truth).max() < 0.015


def test_a_frame_by_itself_does_not_mind():
    pads, obj, frames, truth = grasp(count=5)
    same = [replace(frame, visual_correlation=LASTING) for frame in frames]
    for method in ("vis", "vis+tac+pen"):
        one, other = (run(pads, obj, some, method=method)[-1] for some in (frames, same))
        np.testing.assert_array_equal(one.T_wo.matrix(), other.T_wo.matrix())
        np.testing.assert_array_equal(one.covariance, other.covariance)


def frame_with(correlation, time=1.0):
    pads = PadSet([Pad("tip", (0.01, 0.01))])
    T_wp = np.eye(4)[None]
    seen = gtsam.Pose3()
    measurement = Measurement(
        time, [0], T_wp=T_wp, T_wo_visual=seen, visual_correlation=correlation
    )
    return check(measurement, pads)


def believed(sigma, seen_at):
    information = np.eye(6) / sigma**2
    knowledge = Knowledge(information, np.eye(6), np.zeros((6, 6)))
    return Belief(1.0 - PERIOD, gtsam.Pose3(), knowledge, None, seen_at)


def test_how_many_frames_one_counts_as():
    known = np.eye(6) * 1e6
    at_rest, far, half = (np.eye(6) * variance for variance in (1e-16, 1.0, 1e-6))
    assert frames_alike(60.0, known, at_rest) == pytest.approx(60.0)
    assert frames_alike(60.0, known, far) == pytest.approx(1.0, abs=1e-3)
    assert frames_alike(60.0, known, half) == pytest.approx(2.0, abs=0.05)  # no more are held


def test_which_frames_err_alike():
    config = EstimatorConfig(held=(1e-9, 1e-9, 0.5))

    def counts_as(correlation, seen_at):
        return expectation(believed(1e-3, seen_at), frame_with(correlation), "held", config).repetitions  # fmt: skip

    assert counts_as(2.0, 1.0 - PERIOD) == pytest.approx(60.0)  # 2 s at 30 Hz
    assert counts_as(2.0, 1.0 - 3 * PERIOD) == pytest.approx(20.0)  # every third has an image
    assert counts_as(2.0, 1.0 - 10 * PERIOD) == pytest.approx(15.0)  # 0.5 s, as any frames
    before = believed(1e-3, 1.0 - PERIOD)._replace(correlation=2.0)
    unseen = frame_with(0.0)._replace(T_ho_visual=None)  # pads by themselves err alike as well
    assert expectation(before, unseen, "held", config).repetitions == pytest.approx(60.0)
    assert counts_as(2.0, None) == counts_as(0.0, 1.0 - PERIOD) == pytest.approx(15.0)


@pytest.mark.parametrize("mode", ["moving", "held"])
def test_many_frames_alike_are_worth_what_one_is_not_less_and_hardly_more(mode):
    variances = np.repeat(np.square(SIGMA), 3)
    information = np.diag(1.0 / variances)
    says = FrameInformation(information, np.zeros(6), np.zeros((6, 6)), information)
    frame = frame_with(LASTING)
    belief = believed(SIGMA[1], 1.0 - PERIOD)._replace(
        seen=None,  # its motion is not to be seen
        knowledge=Knowledge(information, np.diag(variances), np.zeros((6, 6))),
    )
    for _ in range(300):
        expected = expectation(belief, frame, mode, EstimatorConfig())
        belief = belief._replace(knowledge=expected.posterior(says))
    known = np.diag(np.linalg.inv(belief.knowledge.information)) / variances
    assert 0.3 < known.mean() < 1.05


@pytest.mark.parametrize("wrong", [-1.0, np.inf, np.nan, "long", None])
def test_a_correlation_that_is_no_time_is_a_mistake(wrong):
    with pytest.raises(ValueError, match="visual_correlation must be a finite number of seconds"):
        frame_with(wrong)
