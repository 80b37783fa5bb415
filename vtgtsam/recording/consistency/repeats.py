# SPDX-License-Identifier: MIT
"""Poses that are sent while nothing is known: the identity, or the last pose again with new stamps.

A measured pose has noise, so that no two are the same to the last bit. What does not move may be seen or
simulated without noise, though: a pose that repeats itself is left out only where the hand moves in touch,
and the identity only where the object would have jumped there.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import gtsam
import numpy as np

from ..align import Streams
from ..decode import note
from ..poses import PoseStream
from ..topics import Topics
from .evidence import Evidence
from .finding import Finding

LONGEST_RUN = 4  # of equal poses, as from a tracker whose poses are sent several times each
MOVED, TURNED = 0.01, np.deg2rad(5)  # [m], [rad], of the hand that holds the object
JUMP, TURN = 0.05, np.deg2rad(30)  # [m], [rad], from one pose to the next, that are no motion


def without_identity(
    stream: PoseStream | None, topic: str, warnings: list[str]
) -> PoseStream | None:
    """Poses without those that are the identity, which programs send where they have no pose.

    Args:
        stream: The poses as they came.
        topic: Their topic.
        warnings: Gets a sentence for what is left out.
    """
    if stream is None:
        return None
    identity = (_matrices(stream) == np.eye(4)).all(axis=(1, 2))
    others = np.flatnonzero(~identity)
    if len(others) in (0, len(identity)):  # a world that begins at the object
        return stream
    next_to = [i for i in others.tolist() if identity[max(i - 1, 0) : i + 2].any()]
    if not all(_moved(gtsam.Pose3(), stream.poses[i], JUMP, TURN) for i in next_to):
        return stream
    why = "are the identity, which is sent for no pose"
    note(warnings, topic, int(identity.sum()), len(identity), why)
    return stream.chosen(~identity)


def without_repeats(streams: Streams, topics: Topics, warnings: list[str]) -> Streams:
    """Streams without visual poses that repeat the one before them while the hand moves in touch."""
    vision, hand = streams.vision, streams.hand_pose
    if vision is None or hand is None or streams.contacts is None:
        return streams
    lasts = runs(_matrices(vision))
    stale = np.zeros(len(lasts), dtype=bool)
    for start, end in _long_runs(lasts):
        if _moves_in_touch(streams, int(vision.times_ns[start]), int(vision.times_ns[end])):
            stale[start + 1 : end + 1] = True
    why = "repeat the pose before them to the last bit while the hand moves and pads touch"
    note(warnings, topics.vision.topic, int(stale.sum()), len(stale), why)
    return dataclasses.replace(streams, vision=vision.chosen(~stale))


def _matrices(stream: PoseStream) -> np.ndarray:
    return np.array([T.matrix() for T in stream.poses])


def runs(matrices: np.ndarray) -> np.ndarray:
    """How many equal ones came directly before each pose (N, 4, 4), int, shape (N,)."""
    same = np.concatenate([[False], (matrices[1:] == matrices[:-1]).all(axis=(1, 2))])
    index = np.arange(len(same))
    return index - np.maximum.accumulate(np.where(same, 0, index))


def _long_runs(lasts: np.ndarray) -> Iterator[tuple[int, int]]:
    """First and last index of each run of more than ``LONGEST_RUN`` equal poses."""
    ends = np.flatnonzero(np.append(lasts[1:] == 0, True))
    for end in ends[lasts[ends] >= LONGEST_RUN].tolist():
        yield end - int(lasts[end]), end


def check_repeats(evidence: Evidence) -> Iterator[Finding]:
    """True poses that stay while the hand moves in touch."""
    truth = evidence.streams.truth
    if truth is None:
        return
    for start, end in _long_runs(runs(_matrices(truth))):
        from_ns, to_ns = int(truth.times_ns[start]), int(truth.times_ns[end])
        if _moves_in_touch(evidence.streams, from_ns, to_ns):
            yield Finding(
                "truth repeats itself",
                f"{evidence.topics.truth} repeats one pose from {from_ns / 1e9:.2f} to {to_ns / 1e9:.2f} s "
                "while the hand moves and pads touch; leave out true poses that were not measured",
                "problem",
                evidence.topics.truth,
            )
            return


def _moves_in_touch(streams: Streams, from_ns: int, to_ns: int) -> bool:
    """Whether the hand goes elsewhere and some pad touches all the time."""
    hand, contacts = streams.hand_pose, streams.contacts
    if hand is None or contacts is None:
        return False
    first, last = hand.held(np.array([from_ns, to_ns])).tolist()
    if first < 0 or not _moved(hand.poses[first], hand.poses[last], MOVED, TURNED):
        return False
    instants = np.linspace(from_ns, to_ns, 20).astype(np.int64)
    bits, _ = contacts.held(instants, list(contacts.columns))
    return bool((bits > 0.5).any(axis=1).all())


def _moved(a: gtsam.Pose3, b: gtsam.Pose3, distance: float, angle: float) -> bool:
    between = a.between(b)
    turned = float(np.linalg.norm(gtsam.Rot3.Logmap(between.rotation())))
    return bool(np.linalg.norm(between.translation()) > distance or turned > angle)
