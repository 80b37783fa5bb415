# SPDX-License-Identifier: MIT
"""The newest values of all streams, each with the instant it belongs to.

Devices speak at their own pace and late; the estimator asks what held at one instant. So each stream
keeps its last seconds, and ``held`` gives its last sample at or before an instant, as a reader of the
recording does.

What the estimator has used must never change afterwards, or the recording could not be replayed to the
same poses: once it has fused an instant, the streams are sealed up to it. A sample that arrives later
with an earlier stamp is refused: neither fused nor recorded, but counted.

Instants are whole nanoseconds since the run began, as they are recorded.

How old a stream may be, and what happens when it is older:

| stream | older than | what happens |
|---|---|---|
| joints, pads | 0.1 s | the fingers wait where they are; nothing is fused |
| joints, pads | 1 s | the run ends, torque off |
| vision | 0.2 s | the visual pose is left out; touch and the hand's shape go on alone |

What a single servo does wrong (silence, heat, overload) is judged in ``hardware.servo.safety``, in the
cycle in which it shows.
"""

from __future__ import annotations

import threading
import time
from bisect import bisect_right
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

from vtgtsam.exceptions import VtgtsamError

T = TypeVar("T")

CAPACITY = 256  # samples, 5 s at 50 Hz


class RunClock:
    """Turns monotonic time into nanoseconds since the run began.

    Attributes:
        start: When it began, by the monotonic clock [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self.start = clock()

    def now_ns(self) -> int:
        """The present."""
        return self.instant_ns(self._clock())

    def instant_ns(self, monotonic: float) -> int:
        """The instant of a monotonic time [s]."""
        return round((monotonic - self.start) * 1e9)


@dataclass(frozen=True, eq=False)
class Sample(Generic[T]):
    """A value and the instant it belongs to [ns]."""

    instant_ns: int
    value: T


class Slot(Generic[T]):
    """The last samples of one stream, whose instants increase.

    Attributes:
        count: Samples taken so far.
        refused: Samples that came too late.
    """

    def __init__(self, capacity: int = CAPACITY) -> None:
        self._samples: list[Sample[T]] = []
        self._capacity = capacity
        self.count = 0
        self.refused = 0

    def put(self, instant_ns: int, value: T, after_ns: int) -> bool:
        """Take a sample, if it is newer than those before it and than ``after_ns``."""
        latest = self.latest()
        if instant_ns <= after_ns or (latest is not None and instant_ns <= latest.instant_ns):
            self.refused += 1
            return False
        self._samples.append(Sample(instant_ns, value))
        del self._samples[: -self._capacity]
        self.count += 1
        return True

    def latest(self) -> Sample[T] | None:
        """The newest sample."""
        return self._samples[-1] if self._samples else None

    def held(self, instant_ns: int) -> Sample[T] | None:
        """The last sample at or before an instant."""
        index = bisect_right(self._samples, instant_ns, key=lambda sample: sample.instant_ns)
        return self._samples[index - 1] if index else None


class Streams:
    """Named slots that many threads write and one reads; sealed as they are read.

    Attributes:
        changed: Notified when a sample has come; its lock guards everything here.
        sealed_ns: No sample at or before this instant is taken any more.
    """

    def __init__(self, names: tuple[str, ...]) -> None:
        self.changed = threading.Condition()
        self.sealed_ns = -1
        self._slots: dict[str, Slot] = {name: Slot() for name in names}

    def put(
        self,
        name: str,
        instant_ns: int,
        value: object,
        then: Callable[[], None] = lambda: None,
    ) -> bool:
        """Add a sample to a stream.

        Args:
            name: The stream.
            instant_ns: The instant the value belongs to.
            value: The value.
            then: Called before anyone else sees the sample, if it is taken.

        Returns:
            Whether it was taken: it came in time.
        """
        with self.changed:
            taken = self._slots[name].put(instant_ns, value, self.sealed_ns)
            if taken:
                then()
                self.changed.notify_all()
            return taken

    def latest(self, name: str) -> Sample | None:
        """A stream's newest sample."""
        with self.changed:
            return self._slots[name].latest()

    def held(self, name: str, instant_ns: int) -> Sample | None:
        """A stream's last sample at or before an instant."""
        with self.changed:
            return self._slots[name].held(instant_ns)

    def seal(self, instant_ns: int) -> dict[str, Sample | None]:
        """What holds in each stream at an instant, which from now on stays so."""
        with self.changed:
            self.sealed_ns = max(self.sealed_ns, instant_ns)
            return {name: slot.held(instant_ns) for name, slot in self._slots.items()}

    def age(self, name: str, now_ns: int) -> float:
        """How old a stream's newest sample is [s]; infinity where there is none."""
        latest = self.latest(name)
        return float("inf") if latest is None else (now_ns - latest.instant_ns) / 1e9

    def count(self, name: str) -> int:
        """How many samples a stream has had."""
        return self._slots[name].count

    def refused(self) -> dict[str, int]:
        """How many samples of each stream came too late."""
        return {name: slot.refused for name, slot in self._slots.items()}


MAX_AGE = {"joints": 0.1, "pads": 0.1, "vision": 0.2}  # [s]
GIVE_UP = 1.0  # [s], joints and pads

_ADVICE = {
    "joints": "is the computer too busy, or the adapter slow (`python -m hardware check`)?",
    "pads": "is the pad board's cable loose (`python -m hardware check`)?",
}


class LiveError(VtgtsamError):
    """The run cannot go on."""


def stale(ages: Mapping[str, float]) -> tuple[str, ...]:
    """Names of the streams that are too old to be used."""
    return tuple(name for name, age in ages.items() if age > MAX_AGE[name])


def may_move(ages: Mapping[str, float]) -> bool:
    """Whether the fingers may go on closing."""
    return not {"joints", "pads"} & set(stale(ages))


def check_ages(ages: Mapping[str, float], give_up: float = GIVE_UP) -> None:
    """LiveError where a stream that the hand cannot do without has been silent for ``give_up`` [s]."""
    for name, advice in _ADVICE.items():
        if ages.get(name, 0.0) > give_up:
            raise LiveError(f"no {name} for {ages[name]:.1f} s: {advice}")
