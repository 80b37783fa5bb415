# SPDX-License-Identifier: MIT
"""What the messages of the map's topics become; each is only put where the fusing thread finds it.

Messages are plain objects with their definition's fields, as in ``vtgtsam.recording``, whose rules hold here too: a
message that cannot be used costs itself, is counted, and its topic says why.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import gtsam
import numpy as np

from ..live.inputs import Inputs
from ..live.slots import PoseSlot
from ..recording import messages
from ..recording.covariance import is_known, tangent_from_ros
from ..recording.named import ARRAYS, TYPES_OF_CONTACTS, contact_bits
from ..recording.poses import TYPES as POSE_TYPES
from ..recording.poses import pose_fields
from ..recording.topics import ContactsTopic, Topics
from .baseline import Baseline
from .publisher_clock import PublisherClock

Handler = Callable[[Any], None]


class Unusable(Exception):
    """A message that cannot be used; says why."""


class Intake:
    """One topic's messages on their way in.

    Args:
        topic: Its name.
        types: The types that are understood.
        take: Takes a message.

    Attributes:
        messages: Messages that came.
        unusable: Messages of them that could not be used.
        why: What was wrong with the last of those.
    """

    def __init__(self, topic: str, types: Sequence[str], take: Handler) -> None:
        self.topic = topic
        self.types = tuple(types)
        self._take = take
        self._arrived = float("-inf")
        self.messages = 0
        self.unusable = 0
        self.why = ""

    def __call__(self, message: Any) -> None:
        """Take a message, whatever is in it."""
        self.messages += 1
        try:
            self._take(message)
            self._arrived = time.monotonic()
        except (Unusable, ValueError, TypeError, OverflowError) as error:
            self.unusable += 1
            self.why = str(error)

    def silence(self) -> float:
        """How long ago the last usable message came [s]; infinity where there was none."""
        return time.monotonic() - self._arrived


class Stamps:
    """The instants of a topic's messages: their headers', or those of receipt where it has none."""

    def __init__(self, clock: PublisherClock) -> None:
        self._clock = clock
        self._stamped = False

    def of(self, message: Any) -> int:
        """A message's instant [ns].

        Raises:
            Unusable: Its topic has stamps, but this message has none.
        """
        stamp_ns = messages.stamp_ns(message) if hasattr(message, "header") else 0
        if stamp_ns:
            self._stamped = True
            return stamp_ns
        if self._stamped:
            raise Unusable("has no stamp in its header, where others have")
        return self._clock.now_ns()


def joints_intake(topic: str, inputs: Inputs, clock: PublisherClock) -> Intake:
    """Joint angles; several publishers may share the topic, each with some of the joints."""
    stamps = Stamps(clock)

    def take(message: Any) -> None:
        names, angles = list(message.name), list(message.position)
        if not names or len(names) != len(angles):
            raise Unusable(f"has {len(angles)} angles for {len(names)} names")
        stamp_ns = stamps.of(message)
        if inputs.put_joints(stamp_ns, names, angles):  # one that is refused tells nothing
            clock.note(stamp_ns)

    return Intake(topic, (messages.JOINT_STATE,), take)


def contacts_intake(entry: ContactsTopic, inputs: Inputs, clock: PublisherClock) -> Intake:
    """Contact bits, whatever of the map's types the topic has."""
    stamps = Stamps(clock)
    baseline = None if entry.calibration is None else Baseline(entry)

    def put(stamp_ns: int, names: Sequence[str], felt: np.ndarray, bits: np.ndarray) -> None:
        if len(names) != len(bits):
            raise Unusable(f"has {len(bits)} values for {len(names)} names")
        known = np.isfinite(bits)
        inputs.put_contacts(stamp_ns, names, bits.tolist(), np.where(known, felt, 0.0).tolist())

    def take(message: Any) -> None:
        stamp_ns = stamps.of(message)
        if hasattr(message, "contact"):  # TactilePads
            felt = np.asarray(message.pressure, dtype=np.float64)
            bits = np.asarray(message.contact, dtype=np.float64)
            if entry.threshold is not None:
                bits = contact_bits(felt, entry.threshold)
            put(stamp_ns, list(message.name), felt, bits)
        elif hasattr(message, "effort"):
            effort = np.asarray(message.effort, dtype=np.float64)
            if entry.threshold is None:
                raise Unusable(
                    "needs a threshold in the map: contacts: {topic: ..., threshold: ...}"
                )
            put(stamp_ns, list(message.name), effort, contact_bits(effort, entry.threshold))
        else:
            take_array(stamp_ns, message)

    def take_array(stamp_ns: int, message: Any) -> None:
        if entry.names is None:
            raise Unusable(
                "names no pads; give the map their names: contacts: {topic: ..., names: [...]}"
            )
        values = np.array(list(message.data), dtype=np.float64)
        is_bytes = isinstance(message.data, bytes | bytearray) or "B" == getattr(
            message.data, "typecode", ""
        )
        if entry.threshold is None and not is_bytes:
            raise Unusable("needs a threshold in the map: contacts: {topic: ..., threshold: ...}")
        threshold = 1.0 if entry.threshold is None else entry.threshold
        if baseline is not None:
            pressed = baseline.pressures(stamp_ns, values, threshold)
            if pressed is None:
                return
            values = pressed
        put(stamp_ns, entry.names, values, contact_bits(values, threshold))

    return Intake(entry.topic, (*TYPES_OF_CONTACTS, *ARRAYS), take)


def _pose(message: Any) -> gtsam.Pose3:
    pose = messages.pose_from_fields(pose_fields(message))
    if pose is None:
        raise Unusable("is not finite, or its quaternion's norm is not 1")
    return pose


def hand_pose_intake(topic: str, inputs: Inputs, clock: PublisherClock) -> Intake:
    """The hand's pose in the world."""
    stamps, put = Stamps(clock), _without_repeats(inputs.put_hand_pose)
    return Intake(topic, POSE_TYPES, lambda message: put(stamps.of(message), _pose(message)))


def camera_pose_intake(
    topic: str, put_pose: Callable[[int, gtsam.Pose3], bool], clock: PublisherClock
) -> Intake:
    """The camera's pose in the world."""
    stamps, put = Stamps(clock), _without_repeats(put_pose)
    return Intake(topic, POSE_TYPES, lambda message: put(stamps.of(message), _pose(message)))


def _without_repeats(
    put: Callable[[int, gtsam.Pose3], bool],
) -> Callable[[int, gtsam.Pose3], None]:
    """The same, but for a stamp that comes twice: there are two subscriptions, and both may bring it."""
    last: list[int] = []

    def put_once(stamp_ns: int, pose: gtsam.Pose3) -> None:
        if last != [stamp_ns]:
            last[:] = [stamp_ns]
            put(stamp_ns, pose)

    return put_once


def vision_intake(
    topics: Topics, inputs: Inputs, camera: PoseSlot, clock: PublisherClock
) -> Intake:
    """The tracker's poses, at the instants of their images and in the world."""
    entry, stamps = topics.vision, Stamps(clock)
    latency_ns = round(entry.latency * 1e9)
    seen: list[bool] = []  # whether a pose has come that is not the identity

    def take(message: Any) -> None:
        pose = _pose(message)
        stamp_ns = stamps.of(message) - latency_ns
        identity = bool((pose.matrix() == np.eye(4)).all())
        if identity and seen:
            raise Unusable("is the identity, which is sent for no pose")
        if not identity and not seen:
            seen.append(True)
        covariance = _covariance(message, pose)
        if entry.frame == "camera":
            T_wc = camera.held(stamp_ns)
            if T_wc is None:
                raise Unusable("is in the camera's frame, whose pose is not known at that instant")
            pose = T_wc.compose(pose)
        inputs.put_vision(stamp_ns, pose, covariance)

    return Intake(entry.topic, POSE_TYPES[:2], take)


def _covariance(message: Any, pose: gtsam.Pose3) -> np.ndarray | None:
    """The covariance of a pose's right perturbation; zeros where it is not known, None where the type has none."""
    given = getattr(message.pose, "covariance", None)
    if given is None:
        return None
    ros = np.asarray(given, dtype=np.float64).reshape(6, 6)
    return tangent_from_ros(ros, pose.rotation()) if is_known(ros) else np.zeros((6, 6))
