# SPDX-License-Identifier: MIT
"""Images that err alike count as one: memory does not take from many what one of them knows."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest
from lump_grasp import PERIOD, SEEN, errors, grasp, run

from vtgtsam import EstimatorConfig, Measurement
from vtgtsam.frame import check
from vtgtsam.hands.pads import Pad, PadSet
from vtgtsam.knowledge import FrameInformation, Knowledge
from vtgtsam.memory import Belief, expectation, images_alike

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


def test_how_many_images_one_counts_as():
    frame = frame_with(2.0)
    at_rest, far, half = (np.eye(6) * variance for variance in (1e-16, 1.0, 1e-6))
    now = believed(1e-3, 1.0 - PERIOD)
    assert images_alike(now, frame, at_rest) == pytest.approx(60.0)  # 2 s at 30 Hz
    assert images_alike(now, frame, far) == pytest.approx(1.0, abs=1e-3)
    assert images_alike(now, frame, half) == pytest.approx(30.5)  # as far as memory holds the rest
    rarely = believed(1e-3, 1.0 - 10 * PERIOD)  # of ten frames one had an image
    assert images_alike(rarely, frame, at_rest) == pytest.approx(6.0)
    never = believed(1e-3, None)
    assert images_alike(never, frame, at_rest) == 1.0
    assert images_alike(now, frame_with(0.0), at_rest) == 1.0


@pytest.mark.parametrize("known", [6, 3, 0])
def test_the_share_that_offsets_make_is_that_of_what_is_said(known):
    information = np.diag([1e4] * known + [0.0] * (6 - known))
    pull = np.sqrt(0.25 * information)  # of six offsets with variance 1
    says = FrameInformation(information, np.zeros(6), pull, 0.75 * information)
    assert says.offsets_share == pytest.approx(0.25 if known else 0.0)
    assert says._replace(pull=np.zeros((6, 6)), noise=information).offsets_share == 0.0


@pytest.mark.parametrize(
    ("share", "frames", "images"),
    [
        (0.0, 15, 60),  # of a robot that knows itself: 0.5 s at 30 Hz, beside 2 s
        (0.25, 1 + 89 / 4, 60),  # a quarter of what is unsure stays: 3 s
        (1.0, 60, 60),  # never less than images
    ],
)
def test_pads_of_a_robot_that_is_wrong_about_itself_err_alike_as_well(share, frames, images):
    config = EstimatorConfig(held=(1e-9, 1e-9, 0.5), offsets_correlation=3.0)
    before = believed(1e-3, 1.0 - PERIOD)._replace(offsets_share=share)
    expected = expectation(before, frame_with(2.0), "held", config)
    assert expected.repetitions == pytest.approx(frames)
    assert expected.repetitions * expected.images_alike == pytest.approx(images)
    unlike = expectation(before, frame_with(0.0), "held", config)
    assert (unlike.repetitions, unlike.images_alike) == (pytest.approx(15), 1.0)


@pytest.mark.parametrize("wrong", [-1.0, np.inf, np.nan, "long", None])
def test_a_correlation_that_is_no_time_is_a_mistake(wrong):
    with pytest.raises(ValueError, match="visual_correlation must be a finite number of seconds"):
        frame_with(wrong)
