# SPDX-License-Identifier: MIT
"""Frames hold each other up: a hand with an object in it, seen by a tracker that fails in known ways."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest
from lump_grasp import SEEN, errors, grasp, run

from vtgtsam import EstimatorConfig


def test_it_is_what_a_plain_estimator_does_and_the_papers_does_not():
    assert EstimatorConfig().memory
    assert not EstimatorConfig.simulation().memory and not EstimatorConfig.real_world().memory


def test_jitter_averages_out_while_the_object_is_held():
    pads, obj, frames, truth = grasp()
    weak = {"w_tac": 1e4, "w_pen": 1e4}  # 1 cm: it is vision that tells
    with_memory = errors(run(pads, obj, frames, **weak), truth)[30:]
    without = errors(run(pads, obj, frames, method="vis+tac+pen", **weak), truth)[30:]
    assert np.median(with_memory) < 0.6 * np.median(without)


def test_a_tracker_that_flips_for_a_second_is_not_followed():
    pads, obj, frames, truth = grasp()
    flip = gtsam.Pose3(gtsam.Rot3.Rx(np.pi), np.array([0.0, 0.01, 0.0]))
    for n in range(40, 50):
        frames[n] = replace(frames[n], T_wo_visual=truth[n].compose(flip))
    estimates = run(pads, obj, frames)
    assert errors(estimates, truth)[40:].max() < 0.003
    assert max(e.visual_weight for e in estimates[40:50]) < 0.1


def test_a_tracker_that_is_silent_while_the_hand_turns_is_not_missed():
    pads, obj, frames, truth = grasp(turning=0.8)
    for n in range(30, 90):
        frames[n] = replace(frames[n], T_wo_visual=None, visual_sigma=None)
    assert errors(run(pads, obj, frames), truth)[30:].max() < 0.003


def test_vision_takes_over_at_once_where_nothing_touches():
    pads, obj, frames, truth = grasp()
    away = gtsam.Pose3(gtsam.Rot3(), np.array([0.0, 0.0, 0.3]))
    for n in range(45, 90):
        frames[n] = replace(
            frames[n], contacts=np.zeros(12, bool), T_wo_visual=truth[n].compose(away)
        )
        truth[n] = truth[n].compose(away)
    estimates = run(pads, obj, frames)
    assert errors(estimates, truth)[46:].max() < 0.01
    assert estimates[60].mode == "free"


def test_a_pose_that_comes_late_is_fused_at_its_own_instant():
    """100 ms late while the hand turns by 0.8 rad/s: 8 cm per second at 0.1 m, 8 mm off if it were taken for now."""
    pads, obj, frames, truth = grasp(turning=0.8, noise=0.2, away=0.05)
    nothing = np.zeros(12, bool)  # no touch: only vision says where the object is
    late = 3
    delayed = []
    for n, frame in enumerate(frames):
        seen = frames[n - late] if n >= late else None
        delayed.append(
            replace(
                frame,
                contacts=nothing,
                T_wo_visual=None if seen is None else seen.T_wo_visual,
                visual_sigma=None if seen is None else SEEN,
                visual_time=None if seen is None else seen.time,
            )
        )
    estimates = [e for e in run(pads, obj, delayed) if e.T_wo is not None]
    assert errors(estimates[10:], truth[len(truth) - len(estimates) + 10 :]).max() < 0.003
    assert all(e.time == frames[-len(estimates) + i].time for i, e in enumerate(estimates))


def test_a_pose_that_comes_after_the_next_ones_gives_what_it_would_have_given_in_time():
    pads, obj, frames, _ = grasp(count=30, turning=0.3)
    expected = run(pads, obj, frames)[-1]
    unseen = replace(frames[20], T_wo_visual=None, visual_sigma=None)
    late = replace(
        frames[23], T_wo_visual=frames[20].T_wo_visual, visual_time=frames[20].time
    )  # beside the pose of 23, which came in time
    found = run(pads, obj, [*frames[:20], unseen, *frames[21:24], late, *frames[24:]])[-1]
    without = run(pads, obj, [*frames[:20], unseen, *frames[21:]])[-1]
    apart = np.linalg.norm(found.T_wo.translation() - expected.T_wo.translation())
    assert apart < 1e-5
    assert apart < 0.5 * np.linalg.norm(without.T_wo.translation() - expected.T_wo.translation())


def test_a_pose_that_is_half_a_second_late_is_left_out_and_named():
    pads, obj, frames, _ = grasp(count=40)
    frames[-1] = replace(frames[-1], visual_time=frames[-1].time - 0.6)
    assert "vision too late" in run(pads, obj, frames)[-1].faults


def test_a_late_pose_is_judged_as_one_in_time_is():
    pads, obj, frames, truth = grasp(count=60, turning=0.3)
    wrong = gtsam.Pose3(gtsam.Rot3.Rx(np.deg2rad(14)), np.array([0.0, 0.03, 0.0]))
    for n in range(30, 60):
        frames[n] = replace(frames[n], T_wo_visual=truth[n].compose(wrong))
    late = [
        replace(frame, T_wo_visual=seen.T_wo_visual, visual_time=seen.time)
        for frame, seen in zip(frames[2:], frames, strict=False)
    ]
    in_time, delayed = run(pads, obj, frames)[2:], run(pads, obj, [*frames[:2], *late])[2:]
    for estimates in (in_time, delayed):
        assert min(e.visual_weight for e in estimates[5:25]) > 0.3
        assert max(e.visual_weight for e in estimates[31:]) < 0.1
        assert {e.status for e in estimates[5:25]} == {"ok"}
        assert {e.status for e in estimates[40:]} == {"contradicted"}


def test_the_same_instant_twice_widens_nothing():
    pads, obj, frames, _ = grasp(count=20)
    unseen = replace(frames[-1], T_wo_visual=None, visual_sigma=None, contacts=np.zeros(12, bool))
    before, again = run(pads, obj, [*frames, unseen])[-2:]
    assert np.trace(again.covariance) <= np.trace(before.covariance) * (1 + 1e-6)


def test_an_earlier_instant_is_an_answer_and_leaves_nothing_behind():
    pads, obj, frames, _ = grasp(count=30)
    expected = run(pads, obj, frames)[-1]
    found = run(pads, obj, [*frames[:20], frames[5], *frames[20:]])
    assert "time went back" in found[20].faults
    np.testing.assert_array_equal(found[-1].T_wo.matrix(), expected.T_wo.matrix())


def test_joints_or_pads_that_are_not_finite_leave_vision_in():
    pads, obj, frames, truth = grasp(count=30)
    frames[-1] = replace(frames[-1], T_wp=np.full((12, 4, 4), np.nan))
    estimate = run(pads, obj, frames)[-1]
    assert estimate.faults == ("pad poses not finite",)
    assert estimate.visual_weight > 0.1 and errors([estimate], truth[-1:])[0] < 0.005


def test_vision_that_is_not_finite_leaves_touch_in():
    pads, obj, frames, truth = grasp(count=30)
    broken = gtsam.Pose3(gtsam.Rot3(), np.array([np.nan, 0.0, 0.0]))
    frames[-1] = replace(frames[-1], T_wo_visual=broken)
    estimate = run(pads, obj, frames)[-1]
    assert estimate.faults == ("vision not finite",)
    assert errors([estimate], truth[-1:])[0] < 0.003 and estimate.pad_weights.max() > 0.5


@pytest.mark.parametrize("noise", [0.5, 1.0, 2.0])
def test_the_covariance_covers_the_error_of_a_tracker_that_is_as_noisy_as_it_says(noise):
    """Errors of 30 grasps at their ends; the tracker says its true sigma."""
    inside = []
    for seed in range(30):
        pads, obj, frames, truth = grasp(count=25, noise=noise, seed=seed, away=0.05)
        sigma = (SEEN[0] * noise, SEEN[1] * noise)
        frames = [replace(f, visual_sigma=sigma, contacts=np.zeros(12, bool)) for f in frames]
        estimate = run(pads, obj, frames)[-1]
        xi = estimate.T_wo.localCoordinates(truth[-1])
        inside.append(xi @ np.linalg.solve(estimate.covariance, xi) < 12.6)  # chi2, 6, 95 %
    assert np.mean(inside) > 0.8
