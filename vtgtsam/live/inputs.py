# SPDX-License-Identifier: MIT
"""What a robot says, as it comes: many threads put it here, one fuses it.

Whatever is put here only waits; nothing is computed in the thread that brings it. One lock guards all, and under it
each sample gets the instant at which it became known. Those increase strictly, and so does the instant at which a
frame is cut out of what is known. They are the log times of the recording, and a reader that follows them finds for
each frame what the live run knew: the same poses come out.

Stamps are of the publishers' clock. One that is far from its stream's others is refused; where the clock has jumped
back, all that was known is forgotten, for it is of a time to come.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import gtsam
import numpy as np

from ..recording.covariance import is_known
from .clock import Clock
from .exact import as_recorded, covariance_as_recorded
from .recorder import Recorder
from .slots import NamedSlots, PoseSlot
from .stamps import StampGuard
from .vision import VisionQueue, VisualPose

log = logging.getLogger(__name__)

STREAMS = ("joints", "contacts", "hand_pose", "vision")
FLOWING_NS = (
    100_000_000  # a moving hand's pose that has come so lately will come again: it is waited for
)
REWRITTEN_NS = 10**9  # of what is known, how much a new recording begins with


class Cut(NamedTuple):
    """What holds at a frame's instant.

    Attributes:
        stamp_ns: The instant [ns].
        received_ns: When it was cut out [ns], after all that it knows and before all that it does not.
        arrived_ns: When the message came that completed it, by the steady clock [ns].
        joints: Angles [rad], shape (J,).
        contacts: Contact bits, shape (K,).
        T_wh: The hand's pose.
        visual: The visual pose that it takes, or None.
        generation: How often all had been forgotten before.
    """

    stamp_ns: int
    received_ns: int
    arrived_ns: int
    joints: np.ndarray
    contacts: np.ndarray
    T_wh: gtsam.Pose3
    visual: VisualPose | None
    generation: int


class Inputs:
    """The streams of a run.

    Args:
        joint_names: The hand's joints.
        pad_names: The hand's pads.
        clock: The present, by the clock of the stamps.
        recorder: Gets all that is taken.
        hold_ns: How long a visual pose counts again, see ``VisionQueue``.
        hand_moves: Whether the hand's pose is sent and has to be waited for; else the hand stands at the world's
            origin until one comes.
        steady: A clock that does not jump [ns].

    Attributes:
        changed: Notified when a sample has come; its lock guards everything here.
        generation: How often all was forgotten.
        forgotten: Why it was the last time.
        on_forget: Called then.
        on_rewrite: Called where a recording begins with what is known, for what is not known here.
    """

    def __init__(
        self,
        joint_names: Sequence[str],
        pad_names: Sequence[str],
        clock: Clock,
        recorder: Recorder,
        hold_ns: int = 0,
        hand_moves: bool = False,
        steady: Clock = time.monotonic_ns,
    ) -> None:
        self.changed = threading.Condition(threading.RLock())
        self.recorder = recorder
        self.generation = 0
        self.forgotten = ""
        self._joint_names, self._pad_names = tuple(joint_names), tuple(pad_names)
        self._clock, self._steady = clock, steady
        self._hold_ns = hold_ns
        self._hand_moves = hand_moves
        self._counts = dict.fromkeys(STREAMS, 0)
        self._arrived_ns: dict[str, int] = {}
        self.guards = {name: StampGuard() for name in STREAMS}
        self.on_forget: Callable[[], None] = lambda: None
        self.on_rewrite: Callable[[], None] = lambda: None
        self._begin()

    def _begin(self) -> None:
        self.joints = NamedSlots(self._joint_names)
        self.contacts = NamedSlots(self._pad_names)
        self.hand_pose = PoseSlot()
        self.vision = VisionQueue(self._hold_ns)
        self._tick_ns = -1
        self._known: tuple[int | None, int] = (None, 0)  # and since when, by the steady clock

    def put_joints(self, stamp_ns: int, names: Sequence[str], angles: Sequence[float]) -> bool:
        """Joint angles [rad] of some or all joints; whether any was taken."""
        return self._put("joints", stamp_ns, lambda: self._take_joints(stamp_ns, names, angles))

    def put_contacts(
        self,
        stamp_ns: int,
        names: Sequence[str],
        bits: Sequence[float],
        pressure: Sequence[float] | None = None,
    ) -> bool:
        """Contact bits of some or all pads, NaN where one is not known; whether any was taken.

        Args:
            stamp_ns: Their instant [ns].
            names: The pads.
            bits: 0 or 1 for each.
            pressure: Fractions of 6 N, for the recording.
        """
        felt = dict(zip(names, bits if pressure is None else pressure, strict=True))
        return self._put(
            "contacts", stamp_ns, lambda: self._take_contacts(stamp_ns, names, bits, felt)
        )

    def put_hand_pose(self, stamp_ns: int, T_wh: gtsam.Pose3) -> bool:
        """The hand's pose; whether it was taken."""
        pose = as_recorded(T_wh)

        def take() -> bool:
            if not self.hand_pose.put(stamp_ns, pose):
                return False
            self._record("hand_pose", stamp_ns, T_wh)
            return True

        return self._put("hand_pose", stamp_ns, take)

    def put_vision(
        self,
        stamp_ns: int,
        T_wo: gtsam.Pose3,
        covariance: np.ndarray | None = None,
        correlation: float = 0.0,
    ) -> bool:
        """The object's pose in the image of that instant, late as it may be; whether it was taken.

        Args:
            stamp_ns: Instant of the image [ns].
            T_wo: The pose.
            covariance: Its covariance, right perturbation, rotation first, shape (6, 6); zeros where a tracker that
                tells it does not know it this time.
            correlation: How long the errors of such poses stay alike [s].
        """
        read = None
        if covariance is not None and is_known(covariance):
            read = covariance_as_recorded(covariance, T_wo)
        visual = VisualPose(stamp_ns, as_recorded(T_wo), read, correlation)

        def take() -> bool:
            if not self.vision.put(visual):
                return False
            self._record_vision(stamp_ns, T_wo, covariance, correlation)
            return True

        return self._put("vision", stamp_ns, take)

    def _put(self, stream: str, stamp_ns: int, take: Callable[[], bool]) -> bool:
        with self.changed:
            now_ns = self._steady()
            guard = self.guards[stream]
            verdict = guard.judge(stamp_ns, now_ns)
            if verdict == "odd":
                return False
            if verdict == "back":
                self.forget(f"the stamps of {stream} went back by {-guard.apart:.1f} s")
            if not take():
                return False
            self._counts[stream] += 1
            self._arrived_ns[stream] = now_ns
            known_ns = self.known_ns
            if known_ns != self._known[0] or stream == "vision":
                self._known = (known_ns, now_ns)
            self.changed.notify_all()
            return True

    def _take_joints(self, stamp_ns: int, names: Sequence[str], angles: Sequence[float]) -> bool:
        taken = self.joints.put(stamp_ns, names, angles)
        if taken:
            self._record("joint_states", stamp_ns, list(taken), list(taken.values()))
        return bool(taken)

    def _take_contacts(
        self, stamp_ns: int, names: Sequence[str], bits: Sequence[float], felt: dict[str, float]
    ) -> bool:
        taken = self.contacts.put(stamp_ns, names, bits)
        if taken:
            pressure = np.nan_to_num([felt[name] for name in taken], posinf=1.0, neginf=0.0)
            self._record("tactile", stamp_ns, list(taken), pressure, list(taken.values()))
        return bool(taken)

    def _record(self, method: str, stamp_ns: int, *values: object) -> None:
        self.recorder.write(method, stamp_ns, *values, received_ns=self._tick())

    def _record_vision(
        self,
        stamp_ns: int,
        T_wo: gtsam.Pose3,
        covariance: np.ndarray | None,
        correlation: float,
    ) -> None:
        if correlation > 0.0:
            self._record("vision_correlation", stamp_ns, correlation)
        self._record("object_pose", stamp_ns, T_wo, covariance)

    def _tick(self) -> int:
        """The present, later than every instant given before."""
        self._tick_ns = max(self._clock(), self._tick_ns + 1)
        return self._tick_ns

    @property
    def known_ns(self) -> int | None:
        """The instant up to which all that flows is known; None where something has never come."""
        with self.changed:
            known = [self.joints.known_ns, self.contacts.known_ns]
            pose_ns = self.hand_pose.latest_ns
            if self._hand_moves and pose_ns is None:
                return None
            if self.hand_pose.moves and self.silence("hand_pose") < FLOWING_NS / 1e9:
                known.append(pose_ns)
            found = [stamp for stamp in known if stamp is not None]
            return min(found) if len(found) == len(known) else None

    def covers(self, instant_ns: int) -> bool:
        """Whether everything is known that a frame of an instant needs."""
        with self.changed:
            streams = (self.joints, self.contacts)
            known = all(stream.held(instant_ns) is not None for stream in streams)
            return known and self.hand_at(instant_ns) is not None

    def joints_at(self, instant_ns: int) -> np.ndarray | None:
        """The joint angles that hold at an instant [rad], shape (J,); None where they are not known."""
        with self.changed:
            return self.joints.held(instant_ns)

    def contacts_at(self, instant_ns: int) -> np.ndarray | None:
        """The contact bits that hold at an instant, shape (K,); None where they are not known."""
        with self.changed:
            bits = self.contacts.held(instant_ns)
            return None if bits is None else bits > 0.5

    def hand_at(self, instant_ns: int) -> gtsam.Pose3 | None:
        """The hand's pose that holds at an instant; None where it is not known."""
        if self.hand_pose.latest_ns is None:
            return None if self._hand_moves else gtsam.Pose3()
        return self.hand_pose.held(instant_ns)

    def cut(self, instant_ns: int, begin: bool = False) -> Cut | None:
        """What holds at an instant, and a visual pose that no frame has had; None where something is not known.

        Args:
            instant_ns: The instant [ns].
            begin: Whether it is the first frame, at the instant of an image: it takes that image's pose.
        """
        with self.changed:
            joints, contacts = self.joints.held(instant_ns), self.contacts.held(instant_ns)
            T_wh = self.hand_at(instant_ns)
            if joints is None or contacts is None or T_wh is None:
                return None
            visual = self.vision.begin(instant_ns) if begin else self.vision.take(instant_ns)
            return Cut(
                instant_ns,
                self._tick(),
                self._known[1],
                joints,
                contacts > 0.5,
                T_wh,
                visual,
                self.generation,
            )

    def forget(self, why: str) -> None:
        """Begin anew, and so does the recording: what was known is of another time."""
        with self.changed:
            log.warning("%s: starting anew", why)
            self.generation += 1
            self.forgotten = why
            standing = None if self.hand_pose.moves else self.hand_pose
            self._begin()
            if standing is not None:  # perhaps it was sent once, for all time
                self.hand_pose = standing
            for guard in self.guards.values():
                guard.restart()
            self.on_forget()
            self.recorder.begin_another()
            self.rewrite()

    def begin_recording(self) -> None:
        """What comes from here on is recorded, or goes to another recording, which begins with what is known."""
        with self.changed:
            self.recorder.begin_another(always=True)
            self.rewrite()

    def rewrite(self) -> None:
        """Write what is known now once more: a recording that begins here needs it."""
        with self.changed:
            latest_ns = [s.latest_ns for s in (self.joints, self.contacts, self.hand_pose)]
            since_ns = max((stamp for stamp in latest_ns if stamp is not None), default=0)
            since_ns = max(0, since_ns - REWRITTEN_NS)
            for stamp_ns, angles in self.joints.since(since_ns):
                self._record("joint_states", stamp_ns, list(angles), list(angles.values()))
            for stamp_ns, bits in self.contacts.since(since_ns):
                values = list(bits.values())
                self._record("tactile", stamp_ns, list(bits), values, values)
            for stamp_ns, pose in self.hand_pose.since(since_ns):
                self._record("hand_pose", stamp_ns, pose)
            for visual in self.vision.waiting(self.vision.latest_ns or 0):
                self._record_vision(
                    visual.stamp_ns, visual.T_wo, visual.covariance, visual.correlation
                )
            self.on_rewrite()

    def record(self, method: str, stamp_ns: int, *values: object) -> None:
        """Record something else that has become known now; ``method`` is the writer's."""
        with self.changed:
            self._record(method, stamp_ns, *values)

    def count(self, stream: str) -> int:
        """How many samples of a stream have been taken."""
        return self._counts[stream]

    def refused(self, stream: str) -> int:
        """How many values of a stream were refused: not newer than the ones before them, or of odd stamps."""
        slot: NamedSlots | PoseSlot | VisionQueue = getattr(self, stream)
        return slot.refused + self.guards[stream].odd

    def silence(self, stream: str) -> float:
        """How long ago a stream's last sample was taken [s]; infinity where there was none."""
        arrived_ns = self._arrived_ns.get(stream)
        return float("inf") if arrived_ns is None else (self._steady() - arrived_ns) / 1e9

    def age(self, stream: str, now_ns: int) -> float:
        """How old a stream's newest sample is by its stamp [s]; infinity where there is none."""
        with self.changed:
            slot: NamedSlots | PoseSlot | VisionQueue = getattr(self, stream)
            latest_ns = slot.latest_ns
        return float("inf") if latest_ns is None else (now_ns - latest_ns) / 1e9
