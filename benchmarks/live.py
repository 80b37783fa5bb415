# SPDX-License-Identifier: MIT
"""From message to pose: a recording played in real time into the live loop, its vision late."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from vtgtsam import PoseEstimator, Recording, read_recording
from vtgtsam.live.fusion import LATENCY, Fusion, vision_hold
from vtgtsam.live.inputs import Inputs
from vtgtsam.live.recorder import Recorder
from vtgtsam.live.threads import Workers
from vtgtsam.recording.named import NamedStream

from .report import table

SWITCH = 0.0005  # [s], as `vtgtsam ros` has it
NAMES = {
    LATENCY: "last message to pose",
    "instant fused": "instant fused to pose",
    "image": "image to pose",
}

Event = tuple[int, Callable[[], object]]  # when something becomes known [ns], and what is put then
PutNamed = Callable[[int, Sequence[str], Sequence[float]], object]


def run(path: Path, late: float, rate: float) -> None:
    """Play a recording and print the latencies.

    Args:
        path: The recording.
        late: How late its visual poses come [s].
        rate: Frames a second [Hz].
    """
    sys.setswitchinterval(SWITCH)
    fusion = played(read_recording(path), late, rate)
    rows = []
    for name, shown in NAMES.items():
        percentiles = fusion.latencies.percentiles(name)
        if percentiles is not None:
            p50, p95, p99 = (1000 * x for x in percentiles)
            rows.append({"latency [ms]": shown, "p50": p50, "p95": p95, "p99": p99})
    print(f"{fusion.count} poses; vision {1000 * late:.0f} ms late\n")
    print(table(rows))


def played(recording: Recording, late: float, rate: float) -> Fusion:
    """Play a recording in real time; the fusion when it is over."""
    estimator = PoseEstimator(recording.hand, recording.object)
    begin = time.monotonic_ns()

    def now_ns() -> int:
        return time.monotonic_ns() - begin

    inputs = Inputs(
        recording.hand.joint_names,
        recording.hand.pad_names,
        now_ns,
        Recorder(None),
        hold_ns=round(1e9 * vision_hold(estimator)),
        hand_moves=recording.streams.hand_pose is not None,
    )
    fusion = Fusion(inputs, estimator, now_ns, rate=rate)
    events = sorted(events_of(recording, inputs, round(1e9 * late)), key=lambda event: event[0])
    first = events[0][0]
    with Workers() as workers:
        workers.start("fusion", fusion.run)
        begin = time.monotonic_ns() - first
        wait = threading.Event()
        for due, put in events:
            wait.wait(max(0.0, (due - now_ns()) / 1e9))
            put()
        wait.wait(0.2)
        workers.check()
    return fusion


def events_of(recording: Recording, inputs: Inputs, late_ns: int) -> list[Event]:
    """What is put into the inputs, and when; ours is the clock that the recording has."""
    s, hand = recording.streams, recording.hand
    assert s.joints is not None and s.contacts is not None and s.vision is not None
    events: list[Event] = []

    def named(stream: NamedStream, names: Sequence[str], put: PutNamed) -> None:
        times = stream.times_ns
        values, _ = stream.held(times, names)
        for stamp, row in zip(times.tolist(), values.tolist(), strict=True):
            events.append((stamp, partial(put, stamp, names, row)))

    named(s.joints, hand.joint_names, inputs.put_joints)
    named(s.contacts, hand.pad_names, inputs.put_contacts)
    for stream, put, after in (
        (s.hand_pose, inputs.put_hand_pose, 0),
        (s.vision, inputs.put_vision, late_ns),
    ):
        if stream is not None:
            for stamp, pose in zip(stream.times_ns.tolist(), stream.poses, strict=True):
                events.append((stamp + after, partial(put, stamp, pose)))
    return events
