# SPDX-License-Identifier: MIT
"""The last samples of a stream, and what held at an instant.

Devices speak at their own pace and late; the estimator asks what held at one instant. So each stream keeps its last
samples, and gives its last one at or before an instant, as a reader of the recording does. A name's stamps increase:
a sample that is not newer than the one before it is refused, neither fused nor recorded, but counted.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import Generic, TypeVar

import gtsam
import numpy as np

T = TypeVar("T")

KEPT = 1024  # samples of a name: a second at 1 kHz, ten at 100 Hz
SAME = 1e-9  # poses that differ by less in every number are one


class Slot(Generic[T]):
    """The last samples of one name, whose stamps [ns] increase."""

    def __init__(self) -> None:
        self._stamps: list[int] = []
        self._values: list[T] = []

    def put(self, stamp_ns: int, value: T) -> bool:
        """Whether the sample was newer than the last one, and taken."""
        if self._stamps and stamp_ns <= self._stamps[-1]:
            return False
        self._stamps.append(stamp_ns)
        self._values.append(value)
        if len(self._stamps) == 2 * KEPT:
            del self._stamps[:KEPT], self._values[:KEPT]
        return True

    @property
    def latest_ns(self) -> int | None:
        """The newest stamp; None where there is none."""
        return self._stamps[-1] if self._stamps else None

    def held(self, instant_ns: int) -> tuple[int, T] | None:
        """The last sample at or before an instant, its stamp first."""
        index = bisect_right(self._stamps, instant_ns) - 1
        return (self._stamps[index], self._values[index]) if index >= 0 else None

    def since(self, instant_ns: int) -> list[tuple[int, T]]:
        """The samples from the one that held at an instant on."""
        index = max(bisect_right(self._stamps, instant_ns) - 1, 0)
        return list(zip(self._stamps[index:], self._values[index:], strict=True))


class NamedSlots:
    """Numbers by name, each with its own stamps: several publishers may share a stream, each with some of the names.

    Attributes:
        names: The names that are needed; others are ignored.
        refused: Values that were not newer than the ones before them.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self.names = tuple(names)
        self.refused = 0
        self._slots: dict[str, Slot[float]] = {name: Slot() for name in names}

    def put(self, stamp_ns: int, names: Sequence[str], values: Sequence[float]) -> dict[str, float]:
        """Take what is needed, finite and newer; the values that were taken."""
        taken = {}
        for name, value in zip(names, values, strict=True):
            slot = self._slots.get(name)
            if slot is None or not np.isfinite(value):
                continue
            if slot.put(stamp_ns, value):
                taken[name] = value
            else:
                self.refused += 1
        return taken

    @property
    def known_ns(self) -> int | None:
        """The instant up to which every name is known; None where one has never come."""
        latest = [slot.latest_ns for slot in self._slots.values()]
        known = [stamp for stamp in latest if stamp is not None]
        return min(known, default=None) if len(known) == len(latest) else None

    @property
    def latest_ns(self) -> int | None:
        """The newest stamp of any name."""
        latest = [slot.latest_ns for slot in self._slots.values()]
        return max((stamp for stamp in latest if stamp is not None), default=None)

    def held(self, instant_ns: int) -> np.ndarray | None:
        """The values that hold at an instant, in the order of ``names``; None where one is not known then."""
        samples = [slot.held(instant_ns) for slot in self._slots.values()]
        values = [sample[1] for sample in samples if sample is not None]
        return np.array(values) if len(values) == len(samples) else None

    def since(self, instant_ns: int) -> list[tuple[int, dict[str, float]]]:
        """The values from those that held at an instant on, by stamp."""
        found: dict[int, dict[str, float]] = {}
        for name, slot in self._slots.items():
            for stamp_ns, value in slot.since(instant_ns):
                found.setdefault(stamp_ns, {})[name] = value
        return sorted(found.items())

    def missing(self) -> list[str]:
        """Names that have never come."""
        return [name for name, slot in self._slots.items() if slot.latest_ns is None]

    def latest_stamps(self) -> list[int | None]:
        """The newest stamp of each name, in the order of ``names``."""
        return [slot.latest_ns for slot in self._slots.values()]

    def behind(self, instant_ns: int) -> list[str]:
        """Names whose newest value is from before an instant."""
        latest = ((name, slot.latest_ns) for name, slot in self._slots.items())
        return [name for name, stamp in latest if stamp is not None and stamp < instant_ns]


class PoseSlot:
    """Poses of something that moves, or that stands: as long as all are one, it counts whatever its stamp.

    Attributes:
        refused: Poses that were not newer than the ones before them.
    """

    def __init__(self) -> None:
        self._slot: Slot[gtsam.Pose3] = Slot()
        self._first: gtsam.Pose3 | None = None
        self.moves = False
        self.refused = 0

    def put(self, stamp_ns: int, pose: gtsam.Pose3) -> bool:
        """Whether the pose was newer than the last one, and taken."""
        if not self._slot.put(stamp_ns, pose):
            self.refused += 1
            return False
        if self._first is None:
            self._first = pose
        self.moves = self.moves or not pose.equals(self._first, SAME)
        return True

    @property
    def latest_ns(self) -> int | None:
        """The newest stamp; None where there is none."""
        return self._slot.latest_ns

    @property
    def newest(self) -> gtsam.Pose3 | None:
        """The last pose; None where there is none."""
        return None if self.latest_ns is None else self.since(self.latest_ns)[-1][1]

    def held(self, instant_ns: int) -> gtsam.Pose3 | None:
        """The pose that holds at an instant; None where it is not known."""
        if not self.moves:
            return self._first
        sample = self._slot.held(instant_ns)
        return None if sample is None else sample[1]

    def since(self, instant_ns: int) -> list[tuple[int, gtsam.Pose3]]:
        """The poses from the one that held at an instant on; of something that stands still, the first."""
        found = self._slot.since(instant_ns)
        return found if self.moves else found[:1]
