# SPDX-License-Identifier: MIT
"""Stamps of several clocks: one computer ahead of another, or a clock that was set while it ran.

Between the instant in a message's header and its receipt lies the time that it took. That differs from
topic to topic by what cameras and trackers need; a message received well before it was stamped has its
stamp from another clock.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..decode import Arrivals
from .evidence import Evidence
from .finding import Finding

FEWEST = 5  # messages
AHEAD = 0.05  # [s], no network delivers before it was sent
BEHIND = 0.1  # [s], joints, pads and motion capture take less
VISION_BEHIND = 1.0  # [s], a tracker takes less
STEP_PERIODS = 5  # a step back by fewer usual periods is a message that came late
STEP = 0.05  # [s]
DRIFT = 0.1  # [s], from the first fifth of a recording to the last
MOST_STEPS = 3  # of one clock that is set; more are messages out of order


def check_clocks(evidence: Evidence) -> Iterator[Finding]:
    """Topics whose stamps are ahead of or behind those of the joints."""
    delays = dict(_delays(evidence))
    reference = evidence.topics.joints if evidence.topics.joints in delays else None
    if reference is None or len(delays) < 2:
        return
    for topic, delay in delays.items():
        more = delay - delays[reference]
        is_vision = topic == evidence.topics.vision.topic
        if -AHEAD <= more <= (VISION_BEHIND if is_vision else BEHIND):
            continue
        if is_vision:
            advice = (
                f"or say 'latency: {evidence.topics.vision.latency - more:.2f}' in the topic map"
            )
        else:
            advice = "and record again"
        yield Finding(
            "clocks differ",
            f"the stamps of {topic} lie {abs(more):.2f} s {'ahead of' if more < 0 else 'behind'} those of "
            f"{reference} (received {delay:.3f} s and {delays[reference]:.3f} s after them, medians); if "
            f"they are of two computers, synchronise their clocks {advice}",
            "warning",
            topic,
        )


def check_clock_steps(evidence: Evidence) -> Iterator[Finding]:
    """Topics whose stamps go back through a time that they had already told, or leave the others' time."""
    yield from _drifts(evidence)
    for topic, arrivals in _arrivals(evidence):
        for back, at in _steps_back(arrivals.stamps_ns / 1e9):
            yield Finding(
                "clock steps back",
                f"the stamps of {topic} step back by {back:.2f} s at {at:.2f} s and go on from there, so "
                "that two periods lie over each other; use what was recorded before or after it, or "
                "record again",
                "problem",
                topic,
            )


def _drifts(evidence: Evidence) -> Iterator[Finding]:
    """Topics whose time from stamp to receipt changes while the joints' stays, by a step or little by little."""
    changes = {
        topic: arrivals.delay_change
        for topic, arrivals in _arrivals(evidence)
        if len(arrivals.stamps_ns) >= 4 * FEWEST
    }
    joints = changes.get(evidence.topics.joints, 0.0)
    for topic, change in changes.items():
        more = change - joints
        if abs(more) > DRIFT:
            yield Finding(
                "clocks drift apart",
                f"from begin to end the stamps of {topic} {'fall behind' if more > 0 else 'run ahead of'} those "
                f"of {evidence.topics.joints} by {abs(more):.2f} s; the two clocks are not synchronised, or "
                "one was set in between",
                "problem",
                topic,
            )


def _arrivals(evidence: Evidence) -> Iterator[tuple[str, Arrivals]]:
    s, names = evidence.streams, evidence.topics
    for topic, stream in ((names.joints, s.joints), (names.contacts.topic, s.contacts)):
        if stream is not None and stream.arrivals is not None:
            yield topic, stream.arrivals
    for topic, poses in evidence.poses():
        if poses.arrivals is not None:
            yield topic, poses.arrivals


def _delays(evidence: Evidence) -> Iterator[tuple[str, float]]:
    """Median time from stamp to receipt of each topic [s]."""
    for topic, arrivals in _arrivals(evidence):
        if len(arrivals.stamps_ns) >= FEWEST:
            yield topic, arrivals.delay


def _steps_back(stamps: np.ndarray) -> Iterator[tuple[float, float]]:
    """Each step back [s] and the stamp before it [s], of stamps in the order of receipt."""
    steps = np.diff(stamps)
    if len(steps) < 2 * FEWEST:
        return
    least = max(STEP, STEP_PERIODS * float(np.median(np.abs(steps))))
    back = np.flatnonzero(steps < -least)
    if len(back) > MOST_STEPS:
        return
    for k in back.tolist():
        before, after = stamps[: k + 1], stamps[k + 1 :]
        over = np.flatnonzero(after < before[-1])
        under = np.count_nonzero(before > after[0])
        if len(over) < FEWEST or under < FEWEST:
            continue
        # A clock that was set goes on through the time it had told; late messages end with a leap.
        past = after[over[-1] + 1 :]
        if len(past) == 0 or past[0] - after[over[-1]] <= least:
            yield -float(steps[k]), float(stamps[k])
