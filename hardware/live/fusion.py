# SPDX-License-Identifier: MIT
"""The estimator in the live loop.

A visual pose belongs to the instant of its image and comes late, by exposure, transfer and tracking.
So each frame is fused at its image's instant, with the joints and contacts that held then, and not with
those of the moment at which the pose happens to arrive. It waits until joints and pads have passed that
instant, so that nothing that belongs before it is still to come. Without images it goes on at 30 Hz,
from touch and the hand's shape alone: half a second behind, because images may only be slow, and in
the present once there has been none for a second.

What is fused is exactly what a reader of the recording finds at the instants of /estimate/object_pose
(``Recording.measurements(rate="recorded")``): the same poses come out when the run is replayed.
"""

from __future__ import annotations

import threading
from collections import defaultdict
from types import SimpleNamespace

import gtsam
import numpy as np

from vtgtsam import Estimate, Measurement, PoseEstimator
from vtgtsam.recording import messages

from .recorder import Recorder
from .streams import MAX_AGE, RunClock, Sample, Streams, stale

STREAMS = ("joints", "pads", "vision", "images")  # images: whether or not a pose was found in it
PERIOD_NS = round(1e9 / 30)  # between frames where there are no images
PATIENCE_NS = 40_000_000  # how long to wait for joints and pads to pass an image's instant
VISION_HOLD_NS = round(MAX_AGE["vision"] * 1e9)
LATE_NS = 500_000_000  # how late an image may be and still count where images have become rare
CAMERA_GONE = 1.0  # [s], without images: none is waited for
_POLL = 0.005  # [s]


def as_recorded(pose: gtsam.Pose3) -> gtsam.Pose3:
    """A pose as it comes out of a recording: its quaternion rounds the last bits."""
    fields = {name: SimpleNamespace(**part) for name, part in messages.pose_fields(pose).items()}
    recorded = messages.pose_from_fields(SimpleNamespace(**fields))
    if recorded is None:
        raise ValueError(f"not a pose: {pose.matrix()}")
    return recorded


class Fusion:
    """Fuses the streams frame by frame.

    Args:
        streams: Streams of the names ``STREAMS``.
        estimator: The estimator.
        T_wh: Pose of the hand in the world.
        clock: The run's clock.
        recorder: Gets the estimates.

    Attributes:
        latencies: From the instant of each sensor's sample to the pose made with it.
        count: Frames fused so far.
        last: The last estimate.
    """

    def __init__(
        self,
        streams: Streams,
        estimator: PoseEstimator,
        T_wh: gtsam.Pose3,
        clock: RunClock,
        recorder: Recorder,
    ) -> None:
        self._streams = streams
        self._estimator = estimator
        self._T_wh = as_recorded(T_wh)
        self._clock = clock
        self._recorder = recorder
        self._waiting_since = (-1, 0)  # an image's instant, and when it was first seen
        self.latencies = Latencies()
        self.count = 0
        self.last: Estimate | None = None

    def run(self, stop: threading.Event) -> None:
        """Fuse until ``stop`` is set."""
        while not stop.is_set():
            if self.step() is None:
                with self._streams.changed:
                    self._streams.changed.wait(_POLL)

    def step(self) -> Estimate | None:
        """Fuse one frame if there is one to fuse."""
        instant_ns = self.next_instant(self._clock.now_ns())
        if instant_ns is None:
            return None
        samples = self._streams.seal(instant_ns)
        if samples["joints"] is None or samples["pads"] is None:
            return None  # an image from before their first sample
        measurement = self._measurement(
            instant_ns, samples["joints"], samples["pads"], samples["vision"]
        )
        estimate = self._estimator.update(measurement)
        if estimate.T_wo is not None:
            self._recorder.write("estimate", instant_ns, estimate.T_wo)
        self._note(samples, measurement)
        self.last = estimate
        self.count += 1
        return estimate

    def next_instant(self, now_ns: int) -> int | None:
        """The instant that can be fused now [ns], or None."""
        streams = self._streams
        joints, pads = streams.latest("joints"), streams.latest("pads")
        if joints is None or pads is None or streams.latest("vision") is None:
            return None
        ages = {name: streams.age(name, now_ns) for name in ("joints", "pads")}
        if stale(ages):
            return None
        known_ns = min(joints.instant_ns, pads.instant_ns)
        image = streams.latest("images")
        if image is not None and image.instant_ns > streams.sealed_ns:
            if image.instant_ns <= known_ns or self._waited(image.instant_ns, now_ns):
                return image.instant_ns
            return None
        silence = streams.age("images", now_ns)
        if silence < CAMERA_GONE:
            known_ns = min(known_ns, now_ns - LATE_NS)
        blind = silence > MAX_AGE["vision"]
        return known_ns if blind and known_ns >= streams.sealed_ns + PERIOD_NS else None

    def _waited(self, image_ns: int, now_ns: int) -> bool:
        """Whether joints or pads have kept an image waiting for too long."""
        if self._waiting_since[0] != image_ns:
            self._waiting_since = (image_ns, now_ns)
        return now_ns - self._waiting_since[1] > PATIENCE_NS

    def _measurement(
        self, instant_ns: int, joints: Sample, pads: Sample, vision: Sample | None
    ) -> Measurement:
        seen = vision is not None and instant_ns - vision.instant_ns <= VISION_HOLD_NS
        return Measurement(
            time=instant_ns / 1e9,
            contacts=pads.value.contacts,
            joints=joints.value,
            T_wo_visual=vision.value if seen else None,
            T_wh=self._T_wh,
        )

    def _note(self, samples: dict[str, Sample | None], measurement: Measurement) -> None:
        now_ns = self._clock.now_ns()
        for name in ("joints", "pads", "vision"):
            sample = samples[name]
            if sample is not None and (name != "vision" or measurement.T_wo_visual is not None):
                self.latencies.add(name, (now_ns - sample.instant_ns) / 1e9)


class Latencies:
    """Delays by name."""

    def __init__(self) -> None:
        self._seconds: dict[str, list[float]] = defaultdict(list)

    def add(self, name: str, seconds: float) -> None:
        """Note one."""
        self._seconds[name].append(seconds)

    def percentiles(self, name: str) -> tuple[float, float, float] | None:
        """Median, 95 % and 99 % quantile [s]; None where there are none."""
        if not self._seconds[name]:
            return None
        p50, p95, p99 = np.percentile(self._seconds[name], [50, 95, 99])
        return float(p50), float(p95), float(p99)

    def lines(self) -> list[str]:
        """A table."""
        rows = [f"{'sensor-to-pose latency [ms]':28} {'p50':>6} {'p95':>6} {'p99':>6}"]
        for name in sorted(self._seconds):
            found = self.percentiles(name)
            if found is not None:
                rows.append(f"  {name:26} " + " ".join(f"{1000 * x:6.1f}" for x in found))
        return rows
