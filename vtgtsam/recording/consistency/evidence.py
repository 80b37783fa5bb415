# SPDX-License-Identifier: MIT
"""What the checks look at: the streams, and the hand and object where they are known."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from ..align import Streams
from ..poses import PoseStream
from ..topics import Topics
from ..trajectory import PoseTrajectory

if TYPE_CHECKING:
    from ...hands.model import HandModel
    from ...objects import ObjectModel


@dataclass(frozen=True, eq=False)
class Evidence:
    """A recording, or the last seconds of a running robot.

    Attributes:
        streams: What was received.
        topics: Under which names.
        hand: The hand, or None where it cannot be had.
        object: The object, or None where it cannot be had.
        present: Names of all topics there are, read or not.
    """

    streams: Streams
    topics: Topics
    hand: HandModel | None = None
    object: ObjectModel | None = None
    present: Collection[str] = field(default_factory=tuple)

    @cached_property
    def truth(self) -> PoseTrajectory | None:
        """True poses T_wo."""
        return _trajectory(self.streams.truth)

    @cached_property
    def vision(self) -> PoseTrajectory | None:
        """Visual poses T_wo."""
        return _trajectory(self.streams.vision)

    def poses(self) -> Iterator[tuple[str, PoseStream]]:
        """The topics of poses that are there, each with its stream."""
        s, names = self.streams, self.topics
        found = [
            (names.hand_topic, s.hand_pose),
            (names.vision.topic, s.vision),
            (names.truth, s.truth),
        ]
        if isinstance(names.camera_pose, str):
            found.append((names.camera_pose, s.camera_pose))
        yield from ((topic, stream) for topic, stream in found if stream is not None)


def _trajectory(stream: PoseStream | None) -> PoseTrajectory | None:
    if stream is None:
        return None
    return PoseTrajectory(stream.times_ns / 1e9, tuple(stream.poses))
