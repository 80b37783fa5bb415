# SPDX-License-Identifier: MIT
"""What happens to a grasp that memory must get over: vision silent, flipped, off or late, the object taken out.

Each takes a replay and gives it with that in its streams, and the frames that are judged.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import gtsam
import numpy as np

from vtgtsam import Measurement
from vtgtsam.frame import joints_of

from .replay import Replay

BEGIN = 6.0  # [s], the hand turns from 4.5 s to 10 s
LATE = 3  # frames of 33 ms
OFF = (np.deg2rad(14.0), 0.012)  # [rad], [m]
TAKEN, OPENED, GONE = 10.5, 10.8, 11.8  # [s]: the hand opens, has opened, the object is away
HEIGHT = 0.15  # [m]
AFTERWARDS = 0.5  # [s], judged after what was wrong has ended
UP = np.array([0.0, 0.0, 1.0])


class Disturbed(NamedTuple):
    """A replay with something wrong in it.

    Attributes:
        frames: Its frames.
        truths: True poses.
        judged: Which frames count, bool.
    """

    frames: list[Measurement]
    truths: list[gtsam.Pose3]
    judged: np.ndarray


def silent(replay: Replay, seconds: float = 2.0) -> Disturbed:
    """Vision reports nothing."""
    return _vision(replay, seconds, lambda _: None)


def flipped(replay: Replay, seconds: float = 1.0) -> Disturbed:
    """Vision takes the object's other side, half a turn about its x axis."""
    turn = about_centre(replay, gtsam.Rot3.Rx(np.pi))
    return _vision(replay, seconds, lambda T_wo: T_wo.compose(turn))


def off(replay: Replay, seconds: float = 1.0) -> Disturbed:
    """Vision is off by 12 mm and 14 degrees."""
    rng = np.random.default_rng(0)
    axis, direction = (v / np.linalg.norm(v) for v in rng.standard_normal((2, 3)))
    turn = about_centre(replay, gtsam.Rot3.Expmap(OFF[0] * axis))
    step = gtsam.Pose3(gtsam.Rot3(), OFF[1] * direction).compose(turn)
    return _vision(replay, seconds, lambda T_wo: T_wo.compose(step))


def late(replay: Replay, said: bool = True) -> Disturbed:
    """Each visual pose comes 100 ms after its image, with the image's instant or without a word."""
    frames = []
    for n, frame in enumerate(replay.frames):
        seen = replay.frames[n - LATE] if n >= LATE else replace(frame, T_wo_visual=None)
        frames.append(
            replace(
                frame,
                T_wo_visual=seen.T_wo_visual,
                visual_covariance=seen.visual_covariance,
                visual_time=seen.time if said and seen.T_wo_visual is not None else None,
            )
        )
    frames[:LATE] = replay.frames[:LATE]  # the first pose is known
    turning = (replay.times >= 4.5) & (replay.times < 10.0)
    return Disturbed(frames, replay.truths, turning)


def late_unsaid(replay: Replay) -> Disturbed:
    """The same without the image's instant."""
    return late(replay, said=False)


def taken_out(replay: Replay) -> Disturbed:
    """The hand opens after the turn, and somebody lifts the object out of it by 15 cm."""
    frames, truths = [], []
    hand = replay.recording.hand
    start = joints_of(replay.frames[0], hand)
    for frame, T_true in zip(replay.frames, replay.truths, strict=True):
        opened = np.clip((frame.time - TAKEN) / (OPENED - TAKEN), 0.0, 1.0)
        height = HEIGHT * np.clip((frame.time - OPENED) / (GONE - OPENED), 0.0, 1.0)
        lift = gtsam.Pose3(gtsam.Rot3(), height * UP)
        seen = frame.T_wo_visual
        if frame.time >= TAKEN:
            frame = replace(
                frame,
                contacts=np.zeros(len(hand), dtype=bool),
                joints=(1.0 - opened) * joints_of(frame, hand) + opened * start,
                T_wo_visual=None if seen is None else lift.compose(seen),
            )
        frames.append(frame)
        truths.append(lift.compose(T_true))
    return Disturbed(frames, truths, replay.times >= TAKEN)


CASES: dict[str, Callable[[Replay], Disturbed]] = {
    "silent 2 s": silent,
    "flipped 1 s": flipped,
    "off by 12 mm, 14 degrees, 1 s": off,
    "100 ms late": late,
    "100 ms late, not said": late_unsaid,
    "taken out": taken_out,
}


def about_centre(replay: Replay, R: gtsam.Rot3) -> gtsam.Pose3:
    """A turn of the object about the centre of its bounding box, a right perturbation of its pose."""
    centre = replay.recording.object.center
    return gtsam.Pose3(R, centre - R.matrix() @ centre)


def _vision(
    replay: Replay, seconds: float, change: Callable[[gtsam.Pose3], gtsam.Pose3 | None]
) -> Disturbed:
    end = BEGIN + seconds
    frames = [
        replace(frame, T_wo_visual=change(frame.T_wo_visual))
        if frame.T_wo_visual is not None and BEGIN <= frame.time < end
        else frame
        for frame in replay.frames
    ]
    frames = [
        replace(frame, visual_covariance=None) if frame.T_wo_visual is None else frame
        for frame in frames
    ]
    judged = (replay.times >= BEGIN) & (replay.times < end + AFTERWARDS)
    return Disturbed(frames, replay.truths, judged)
