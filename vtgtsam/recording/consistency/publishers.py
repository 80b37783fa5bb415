# SPDX-License-Identifier: MIT
"""Values that jump there and back: two programs publish one name, or a tracker flips.

What moves does not come back from one message to the next, and never again and again. With x_k the samples
and two jumps that follow each other, after samples i and j, the second takes the first back where x_j+1 is
near x_i.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import gtsam
import numpy as np

from ..named import NamedStream
from ..poses import PoseStream
from .evidence import Evidence
from .finding import Finding

LEAST_RETURNS = 4  # jumps that are taken back
RETURN = 0.3  # of the jump, how near it must come back
JOINT_JUMP = 0.1  # [rad], between two messages
SLIDE_JUMP = 0.005  # [m]
POSE_JUMP = 0.02  # [m]
TURN_JUMP = np.deg2rad(20)
FLIP = np.deg2rad(60)  # a tracker's own jitter is less
BITS_WINDOW = 50  # messages of a pad,
BITS_CHANGES = 45  # of which so many change
UNEVEN = 0.15  # of the usual time between two messages, by which steps of two clocks differ

Distance = Callable[[int, int], float]


def check_publishers(evidence: Evidence) -> Iterator[Finding]:
    """Joints, pads, hand and truth that alternate between two values."""
    yield from _joints(evidence)
    yield from _pads(evidence)
    for topic, stream in evidence.poses():
        if topic == evidence.topics.vision.topic:
            yield from _flips(topic, stream)
        elif any(returns >= LEAST_RETURNS for returns in _pose_returns(stream)):
            yield _two(topic, f"the poses on {topic}", max(_pose_returns(stream)))


def _joints(evidence: Evidence) -> Iterator[Finding]:
    stream = evidence.streams.joints
    if stream is None:
        return
    for name, (_, values) in stream.columns.items():
        least = SLIDE_JUMP if _slides(evidence, name) else JOINT_JUMP
        returns = _returns(np.abs(np.diff(values)) > least, lambda i, j, v=values: abs(v[i] - v[j]))  # type: ignore[misc]
        if returns >= LEAST_RETURNS:
            yield _two(name, f"joint {name} on {evidence.topics.joints}", returns)


def _slides(evidence: Evidence, name: str) -> bool:
    from .ranges import slides

    hand = evidence.hand
    return hand is not None and name in hand.joint_names and slides(hand, name)


def _pads(evidence: Evidence) -> Iterator[Finding]:
    """Pads that change with every message, as no touch does but one: an object that rocks against the pad."""
    stream = evidence.streams.contacts
    if stream is None:
        return
    for name, (times, bits) in stream.columns.items():
        changes = (np.diff(bits) != 0).astype(int)
        if len(changes) < BITS_WINDOW:
            continue
        in_window = np.convolve(changes, np.ones(BITS_WINDOW, dtype=int), "valid")
        start, most = int(np.argmax(in_window)), int(in_window.max())
        instants = times[start : start + BITS_WINDOW + 1]
        if most >= BITS_CHANGES and (_uneven(instants) or _all_together(stream, name, instants)):
            yield _two(name, f"pad {name} on {evidence.topics.contacts.topic}", most)


def _uneven(times: np.ndarray) -> bool:
    """Whether every second message comes sooner after the one before it, as from a second clock."""
    steps = np.diff(times)
    if len(steps) % 2:
        steps = steps[1:]
    first, second = steps[0::2].mean(), steps[1::2].mean()
    return bool(abs(first - second) > UNEVEN * (first + second) / 2)


def _all_together(stream: NamedStream, name: str, instants: np.ndarray) -> bool:
    """Whether other pads change with a pad, and none touches throughout.

    Who sends zeros sends them of all pads. An object that rocks is held by a pad, or leaves one pad for
    another.
    """
    bits, _ = stream.held(instants, list(stream.columns))
    own = bits[:, list(stream.columns).index(name)]
    return bool((bits == own[:, None]).all(axis=0).sum() > 1 and not (bits > 0.5).all(axis=0).any())


def _two(about: str, what: str, returns: int) -> Finding:
    return Finding(
        "two publishers of one name",
        f"{what} jumps there and back {returns} times from one message to the next, as where two programs "
        "publish it; stop one of them, or give each its own topic",
        "problem",
        about,
    )


def _flips(topic: str, stream: PoseStream) -> Iterator[Finding]:
    turns, _ = _steps(stream.poses)
    returns = _returns(turns > FLIP, lambda i, j: _angle(stream.poses[i], stream.poses[j]))
    if returns >= LEAST_RETURNS:
        yield Finding(
            "vision flips",
            f"the rotations on {topic} jump by more than {np.rad2deg(FLIP):.0f} degrees and back {returns} "
            "times from one pose to the next, as a tracker does that takes one side of the object for "
            "another; leave such poses out",
            "warning",
            topic,
        )


def _pose_returns(stream: PoseStream) -> tuple[int, int]:
    """How often a jump of position, and one of rotation, is taken back."""
    poses = stream.poses
    turns, moves = _steps(poses)

    def between(i: int, j: int) -> float:
        return float(np.linalg.norm(poses[i].translation() - poses[j].translation()))

    return (
        _returns(moves > POSE_JUMP, between),
        _returns(turns > TURN_JUMP, lambda i, j: _angle(poses[i], poses[j])),
    )


def _steps(poses: object) -> tuple[np.ndarray, np.ndarray]:
    """Angle [rad] and distance [m] from each pose to the next, shape (N - 1,)."""
    matrices = np.array([T.matrix() for T in poses])  # type: ignore[attr-defined]
    R, t = matrices[:, :3, :3], matrices[:, :3, 3]
    traces = np.einsum("nij,nij->n", R[:-1], R[1:])
    angles = np.arccos(np.clip((traces - 1) / 2, -1, 1))
    return angles, np.linalg.norm(np.diff(t, axis=0), axis=1)


def _angle(a: gtsam.Pose3, b: gtsam.Pose3) -> float:
    return float(np.linalg.norm(gtsam.Rot3.Logmap(a.rotation().between(b.rotation()))))


def _returns(jumps: np.ndarray, distance: Distance) -> int:
    """How many jumps (one after each sample but the last, shape (N - 1,)) the next one takes back."""
    where = np.flatnonzero(jumps).tolist()
    count, k = 0, 0
    while k + 1 < len(where):
        i, j = where[k : k + 2]
        least = min(distance(i, i + 1), distance(j, j + 1))
        if distance(i, j + 1) < RETURN * least:
            count, k = count + 1, k + 1
        k += 1
    return count
