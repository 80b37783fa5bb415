# SPDX-License-Identifier: MIT
"""Faults as the estimator names them, and what is left of the pose meanwhile."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest
from lump_grasp import errors, grasp, run

BEGIN = 45  # frame
FLIP = gtsam.Pose3(gtsam.Rot3.Rx(np.pi), np.array([0.0, 0.01, 0.0]))


def spoiled(frames, change):
    return [change(n, frame) if n >= BEGIN else frame for n, frame in enumerate(frames)]


def said(estimates):
    return {word for estimate in estimates for word in estimate.faults}


def first(estimates, word):
    return next(n for n, estimate in enumerate(estimates) if word in estimate.faults)


@pytest.mark.parametrize("noise", [0.5, 1.0, 3.0])
@pytest.mark.parametrize("turning", [0.0, 0.8])
def test_nothing_is_named_where_nothing_is_wrong(noise, turning):
    pads, obj, frames, _ = grasp(noise=noise, turning=turning)
    estimates = run(pads, obj, frames)
    assert said(estimates) == set() and {e.status for e in estimates} == {"ok"}


def test_vision_that_repeats_itself_is_named_after_a_moment_and_left_out():
    pads, obj, frames, truth = grasp(turning=0.8)
    frozen = frames[BEGIN - 1].T_wo_visual
    estimates = run(pads, obj, spoiled(frames, lambda n, f: replace(f, T_wo_visual=frozen)))
    assert 6 <= first(estimates, "vision repeats itself") - BEGIN <= 8
    assert errors(estimates, truth)[BEGIN:].max() < 0.003


def test_a_method_without_memory_takes_vision_as_it_is():
    pads, obj, frames, _ = grasp(turning=0.8)
    frozen = frames[BEGIN - 1].T_wo_visual
    repeated = spoiled(frames, lambda n, f: replace(f, T_wo_visual=frozen))
    estimate = run(pads, obj, repeated, method="vis")[-1]
    assert estimate.T_wo.equals(frozen, 1e-9) and estimate.faults == ()


def test_vision_that_flips_and_stays_so_is_named_at_once_and_never_followed():
    pads, obj, frames, truth = grasp(count=150)
    flipped = spoiled(frames, lambda n, f: replace(f, T_wo_visual=f.T_wo_visual.compose(FLIP)))
    estimates = run(pads, obj, flipped)
    assert first(estimates, "vision jumps") == BEGIN
    assert errors(estimates, truth)[BEGIN:].max() < 0.003
    assert estimates[-1].status == "contradicted"


def test_vision_in_millimetres_is_named_in_its_frame_and_left_out():
    pads, obj, frames, truth = grasp()

    def to_millimetres(n, frame):
        T = frame.T_wo_visual
        away = np.array([0.2, 0.0, 0.0])  # not at the hand's origin
        return replace(frame, T_wo_visual=gtsam.Pose3(T.rotation(), 1e3 * (T.translation() + away)))

    estimates = run(pads, obj, spoiled(frames, to_millimetres))
    assert all(e.faults == ("vision in millimetres",) for e in estimates[BEGIN:])
    assert errors(estimates, truth)[BEGIN:].max() < 0.003


def released(frames, kept):
    """Frames in which only the pads ``kept`` touch; the others stand 3 cm off."""
    away = np.eye(4)
    away[2, 3] = -0.03
    found = []
    for frame in frames:
        T_wp = frame.T_wp.copy()
        T_wp[~kept] = T_wp[~kept] @ away
        found.append(replace(frame, T_wp=T_wp, contacts=kept))
    return found


def test_contacts_that_are_inverted_are_named_at_once_and_left_out_until_they_are_right_again():
    pads, obj, frames, truth = grasp()
    kept = np.arange(12) < 4
    frames = released(frames, kept)
    back = 70
    estimates = run(
        pads,
        obj,
        spoiled(frames, lambda n, f: replace(f, contacts=~kept) if n < back else f),
    )
    assert all("contacts inverted" in e.faults for e in estimates[BEGIN:back])
    assert not said(estimates[back:]) and not said(estimates[:BEGIN])
    assert errors(estimates, truth)[BEGIN:].max() < 0.009  # vision alone: 2 mm along each axis
    assert not {event for e in estimates[BEGIN:] for event in e.events}  # nothing was dropped
    assert estimates[back - 1].status == "contradicted" and estimates[-1].status == "ok"


def test_a_hand_that_is_frozen_while_the_object_moves_is_named():
    pads, obj, frames, truth = grasp(turning=0.8)
    then = frames[BEGIN]
    frozen = spoiled(frames, lambda n, f: replace(f, T_wp=then.T_wp, T_wh=then.T_wh))
    estimates = run(pads, obj, frozen)
    word = "hand frozen while the object moves"
    moved = next(
        n
        for n in range(BEGIN, 90)
        if np.linalg.norm(truth[BEGIN].between(truth[n]).translation()) > 0.01
        or np.linalg.norm(gtsam.Rot3.Logmap(truth[BEGIN].between(truth[n]).rotation())) > 0.17
    )
    assert 0 <= (first(estimates, word) - moved) / 30 < 0.5
    assert errors(estimates, truth)[first(estimates, word) :].max() < 0.01
