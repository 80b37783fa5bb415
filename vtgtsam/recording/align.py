# SPDX-License-Identifier: MIT
"""Streams of different rates brought together: one measurement for each of the given instants."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING

import gtsam
import numpy as np

from ..exceptions import RecordingError
from ..measurement import Measurement
from .named import NamedStream
from .poses import PoseStream

if TYPE_CHECKING:
    from ..hands.model import HandModel

VISION_HOLD_NS = 10**9  # a visual tracker silent for longer than this reports nothing
OTHER_TIME_NS = (
    60 * 10**9
)  # joints and contacts older than this in every frame are of another clock
STALE_NS = 10**9  # joints and contacts held for longer than this are worth a warning


@dataclass
class Streams:
    """What a recording holds; None where it has no such stream.

    ``vision`` has its latency taken off and is given in the world frame. ``vision_sent`` is the same with the poses
    that only repeat others, as a live run got it.
    """

    joints: NamedStream | None
    contacts: NamedStream | None
    hand_pose: PoseStream | None
    vision: PoseStream | None
    truth: PoseStream | None
    estimate: PoseStream | None
    camera_pose: PoseStream | None
    vision_sent: PoseStream | None = None


def to_world(vision: PoseStream, camera: PoseStream, warnings: list[str]) -> PoseStream | None:
    """Visual poses T_co as T_wo = T_wc T_co, with the camera where it was at that instant."""
    index = camera.held(vision.times_ns)
    known = np.flatnonzero(index >= 0)
    if len(known) < len(index):
        warnings.append(
            f"{len(index) - len(known)} of {len(index)} visual poses are left out: "
            "the camera's pose is not known before them"
        )
    if len(known) == 0:
        return None
    # Perturbations of the object's own frame are the same seen from the camera and the world.
    kept = vision.chosen(index >= 0)
    poses = [camera.poses[i] * T for i, T in zip(index[known].tolist(), kept.poses, strict=True)]
    return dataclasses.replace(kept, poses=poses)


def measurements_at(
    instants_ns: np.ndarray,
    streams: Streams,
    hand: HandModel,
    warnings: list[str],
    vision_hold_ns: int = VISION_HOLD_NS,
) -> list[Measurement]:
    """A measurement for each instant [ns] from which on all streams are known, others held.

    Args:
        instants_ns: Instants [ns], int64, shape (F,), increasing.
        streams: With joints and contacts.
        hand: Names the joints and pads.
        warnings: Gets a sentence for what is skipped or long out of date.
        vision_hold_ns: How long a visual pose counts [ns].

    Raises:
        RecordingError: There is no frame, or none has joints and contacts of its own time.
    """
    assert streams.joints is not None and streams.contacts is not None
    joints, joints_age = streams.joints.held(instants_ns, hand.joint_names)
    contacts, contacts_age = streams.contacts.held(instants_ns, hand.pad_names)
    T_wh = _held_poses(streams.hand_pose, instants_ns)
    visual = _held_visual(streams.vision, instants_ns, vision_hold_ns)
    ready = np.isfinite(joints).all(axis=1) & np.isfinite(contacts).all(axis=1)
    if streams.hand_pose is not None:
        ready &= streams.hand_pose.held(instants_ns) >= 0
    if not ready.all():
        warnings.append(
            f"{np.count_nonzero(~ready)} of {len(ready)} frames are skipped, which lie before the "
            "first sample of a joint, a pad or the hand's pose"
        )
    ages = {"joint angles": joints_age[ready], "contacts": contacts_age[ready]}
    if _never_together(ages):
        raise RecordingError(_ranges(instants_ns, streams))
    for what, age in ages.items():
        stale = age[age > STALE_NS]
        if len(stale):
            warnings.append(
                f"{len(stale)} of {len(ready)} frames use {what} that are more than "
                f"{STALE_NS / 1e9:g} s old, up to {stale.max() / 1e9:.1f} s"
            )
    return [
        Measurement(
            time=float(instants_ns[i] / 1e9),
            contacts=contacts[i] > 0.5,
            joints=joints[i],
            T_wo_visual=visual[i][0],
            T_wh=T_wh[i],
            visual_covariance=visual[i][1],
            visual_correlation=visual[i][2],
        )
        for i in np.flatnonzero(ready)
    ]


def _never_together(ages: dict[str, np.ndarray]) -> bool:
    """Whether no frame is left, or each has joints or contacts of another time altogether."""
    return any(len(age) == 0 or age.min() > OTHER_TIME_NS for age in ages.values())


def _ranges(instants_ns: np.ndarray, streams: Streams) -> str:
    times = {"frames": instants_ns}
    for what in ("joints", "contacts", "hand_pose"):
        stream = getattr(streams, what)
        if stream is not None:
            times[what] = stream.times_ns
    ranges = (f"{what} {t[0] / 1e9:.2f} to {t[-1] / 1e9:.2f} s" for what, t in times.items())
    return (
        f"no frame has joints, contacts and hand at its time ({', '.join(ranges)}); "
        "are the stamps of one clock?"
    )


def _held_poses(stream: PoseStream | None, instants_ns: np.ndarray) -> list[gtsam.Pose3]:
    """Last poses at or before each instant; the identity where there is no such stream."""
    if stream is None:
        return [gtsam.Pose3()] * len(instants_ns)
    return [stream.poses[i] for i in stream.held(instants_ns)]


def _held_visual(
    stream: PoseStream | None, instants_ns: np.ndarray, hold_ns: int
) -> list[tuple[gtsam.Pose3 | None, np.ndarray | None, float]]:
    nothing = (None, None, 0.0)
    if stream is None:
        return [nothing] * len(instants_ns)
    index = np.searchsorted(stream.times_ns, instants_ns, side="right") - 1
    fresh = (index >= 0) & (instants_ns - stream.times_ns[index] <= hold_ns)
    return [
        (stream.poses[i], stream.covariances[i], stream.correlation(i)) if ok else nothing
        for i, ok in zip(index, fresh, strict=True)
    ]
