# SPDX-License-Identifier: MIT
"""The estimator in a running robot: one thread that fuses what has come.

A frame's instant is the last one that is known: the newest stamp that joints, contacts and a moving hand's pose have
all passed. So nothing that belongs before it is still to come, and nothing newer is held back. Frames follow each other
at the stamps of the slowest stream, 30 a second, and earlier where a visual pose waits.

A visual pose is of an image that is in the past. Each frame takes one that has come since the last frame, and the
estimator fuses it at its image's instant (``Measurement.visual_time``). Where none has come, the frame goes on from
touch and the hand's shape. Only the first frame is one of the past: it stands at the instant of the first image.

What is fused is what a reader finds in the recording (``Recording.measurements(rate="recorded")``): the same poses
come out when it is replayed.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import NamedTuple

from ..calibration.online import OnlineCalibration
from ..estimate import Estimate
from ..estimator import PoseEstimator
from ..measurement import Measurement
from .clock import Clock
from .inputs import Cut, Inputs
from .latencies import Latencies

RATE = 30.0  # [Hz]
VISION_HOLD = 0.2  # [s], how long a visual pose counts for an estimator without memory
LATENCY = "last message"  # name of the time from the message that completed a frame to its estimate
_WAIT = 0.05  # [s]


class Fused(NamedTuple):
    """A frame that was fused.

    Attributes:
        estimate: What came out.
        measurement: What the estimator was told.
        cut: What was known.
    """

    estimate: Estimate
    measurement: Measurement
    cut: Cut


Taker = Callable[[Fused], None]


Estimator = PoseEstimator | OnlineCalibration


def vision_hold(estimator: Estimator) -> float:
    """How long a visual pose counts in frames that have no newer one [s]: memory needs each but once."""
    return 0.0 if estimator.config.memory else VISION_HOLD


class Fusion:
    """Fuses what a robot's inputs know, frame by frame.

    Args:
        inputs: The streams.
        estimator: The estimator.
        clock: The present, by the clock of the stamps.
        taker: Gets each frame, in the thread that fuses.
        rate: Frames a second, beside those that a visual pose brings forward [Hz].
        steady: A clock that does not jump [ns].

    Attributes:
        latencies: From each sensor's sample to the pose made with it, and from the message that completed a frame.
        count: Frames fused so far.
        latest: The last frame.
        started: How often it began anew.
    """

    def __init__(
        self,
        inputs: Inputs,
        estimator: Estimator,
        clock: Clock,
        taker: Taker = lambda fused: None,
        rate: float = RATE,
        steady: Clock = time.monotonic_ns,
    ) -> None:
        if not rate > 0:
            raise ValueError(f"rate must be above 0 Hz, got {rate}")
        self._inputs = inputs
        self._estimator = estimator
        self._clock, self._steady = clock, steady
        self._taker = taker
        self._period_ns = round(1e9 / rate)
        self._due_ns = 0
        self._last_ns: int | None = None  # instant of the last frame; None: the next is the first
        self._generation = inputs.generation
        self._wanted = False
        self.latencies = Latencies()
        self.count = 0
        self.started = 0
        self.latest: Fused | None = None

    @property
    def last(self) -> Estimate | None:
        """The last estimate."""
        return None if self.latest is None else self.latest.estimate

    def restart(self, at_last_vision: bool = False) -> None:
        """Forget what is remembered before the next frame.

        Args:
            at_last_vision: Whether that starts at the last visual pose; else at the next.
        """
        with self._inputs.changed:
            if at_last_vision:
                self._inputs.vision.again()
            self._wanted = True
            self._inputs.changed.notify_all()

    def run(self, stop: threading.Event) -> None:
        """Fuse until ``stop`` is set."""
        while not stop.is_set():
            self.step(_WAIT)

    def step(self, wait: float = 0.0) -> Estimate | None:
        """Fuse one frame if there is one to fuse, or if one comes within ``wait`` [s]."""
        inputs = self._inputs
        with inputs.changed:
            cut = self._cut()
            if cut is None and wait > 0.0:
                inputs.changed.wait(wait)
                cut = self._cut()
        if cut is None:
            return None
        measurement = measurement_of(cut)
        estimate = self._estimator.update(measurement)
        with inputs.changed:
            if cut.generation != inputs.generation:  # of a time that is forgotten
                return None
            if estimate.T_wo is not None:
                inputs.recorder.write(
                    "estimate", cut.stamp_ns, estimate.T_wo, received_ns=cut.received_ns
                )
        self.latest = Fused(estimate, measurement, cut)
        self._taker(self.latest)
        self._note(cut)
        self.count += 1
        return estimate

    def next_instant(self) -> int | None:
        """The instant that can be fused now [ns], or None."""
        inputs = self._inputs
        known_ns = inputs.known_ns
        if known_ns is None:
            return None
        if self._last_ns is None:
            stamps = (pose.stamp_ns for pose in inputs.vision.waiting(known_ns))
            return next((stamp for stamp in stamps if inputs.covers(stamp)), None)
        a_little = self._period_ns // 4
        due = known_ns >= self._due_ns - a_little  # stamps jitter
        if not due and inputs.vision.waiting(known_ns):
            due = known_ns >= self._last_ns + a_little
        return known_ns if due and known_ns > self._last_ns else None

    def _cut(self) -> Cut | None:
        if self._wanted or self._generation != self._inputs.generation:
            self._begin_anew()
        instant_ns = self.next_instant()
        if instant_ns is None:
            return None
        cut = self._inputs.cut(instant_ns, begin=self._last_ns is None)
        if cut is not None:
            on_time = abs(instant_ns - self._due_ns) <= self._period_ns // 2
            self._due_ns = (self._due_ns if on_time else instant_ns) + self._period_ns
            self._last_ns = instant_ns
        return cut

    def _begin_anew(self) -> None:
        inputs = self._inputs
        if self._generation == inputs.generation:  # else it was begun anew where all was forgotten
            inputs.recorder.begin_another()
            inputs.rewrite()
        self._generation = inputs.generation
        self._wanted = False
        self._estimator.reset()
        self._last_ns, self._due_ns, self.latest = None, 0, None
        self.started += 1

    def _note(self, cut: Cut) -> None:
        self.latencies.add(LATENCY, (self._steady() - cut.arrived_ns) / 1e9)
        now_ns = self._clock()
        self.latencies.add("instant fused", (now_ns - cut.stamp_ns) / 1e9)
        if cut.visual is not None:
            self.latencies.add("image", (now_ns - cut.visual.stamp_ns) / 1e9)


def measurement_of(cut: Cut) -> Measurement:
    """What the estimator is told of an instant."""
    visual = cut.visual
    return Measurement(
        time=cut.stamp_ns / 1e9,
        contacts=cut.contacts,
        joints=cut.joints,
        T_wo_visual=None if visual is None else visual.T_wo,
        T_wh=cut.T_wh,
        visual_covariance=None if visual is None else visual.covariance,
        visual_correlation=0.0 if visual is None else visual.correlation,
        visual_time=None if visual is None else visual.stamp_ns / 1e9,
    )
