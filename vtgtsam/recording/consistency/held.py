# SPDX-License-Identifier: MIT
"""The hand against the object: what a pad touches is where the pad is."""

from __future__ import annotations

from collections.abc import Iterator

import gtsam
import numpy as np

from .evidence import Evidence
from .finding import Finding

MOST_FRAMES = 60  # with contact that are looked at
FEWEST = 5  # frames with contact that say something
FAR = 0.05  # [m], the nearest touching pad from the surface: the hand is elsewhere
OFF = 0.008  # [m], of one pad: a few millimetres are what joints' zeros and the truth are off by


def check_held(evidence: Evidence) -> Iterator[Finding]:
    """A hand that is not where its pads touch the object, or one pad that is not."""
    frames = _frames(evidence)
    if frames is None:
        return
    bits, distances, what = frames
    touching = np.where(bits, distances, np.nan)
    some = bits.any(axis=1)
    if some.sum() < FEWEST:
        return
    nearest = float(np.median(np.nanmin(touching[some], axis=1)))
    if nearest > FAR:
        yield Finding(
            "hand far from the object",
            f"while pads touch, the nearest of them is {1e3 * nearest:.0f} mm from the object (median, by "
            f"{what}): {_advice(evidence)}",
            "problem",
        )
        return
    hand = evidence.hand
    assert hand is not None
    if what != "the true pose":  # a tracker may be so far off
        return
    for k, name in enumerate(hand.pad_names):
        of_pad = touching[bits[:, k], k]
        if len(of_pad) >= FEWEST and np.median(of_pad) > OFF:
            yield Finding(
                "pad touches nothing",
                f"pad {name} touches while it is {1e3 * float(np.median(of_pad)):.0f} mm from the object "
                f"(median, by {what}); check its place and its name in the hand's file, its bit, and "
                "the joints' zeros",
                "warning",
                name,
            )


def _frames(evidence: Evidence) -> tuple[np.ndarray, np.ndarray, str] | None:
    """Contact bits and distances of pads to the surface [m] in some frames, shape (F, K), and by which pose."""
    hand, obj, streams = evidence.hand, evidence.object, evidence.streams
    truth, vision = evidence.truth, evidence.vision
    trajectory, what = (
        (truth, "the true pose") if truth is not None else (vision, "the visual pose")
    )
    if hand is None or obj is None or trajectory is None:
        return None
    if streams.joints is None or streams.contacts is None:
        return None
    if not set(hand.joint_names) <= set(streams.joints.columns):
        return None
    if not set(hand.pad_names) <= set(streams.contacts.columns):
        return None
    instants = np.rint(trajectory.times * 1e9).astype(np.int64)
    bits, age = streams.contacts.held(instants, hand.pad_names)
    joints, joints_age = streams.joints.held(instants, hand.joint_names)
    ready = np.isfinite(bits).all(axis=1) & np.isfinite(joints).all(axis=1)
    ready &= (bits > 0.5).any(axis=1) & (np.maximum(age, joints_age) < 10**9)
    chosen = np.flatnonzero(ready)
    chosen = chosen[:: max(-(-len(chosen) // MOST_FRAMES), 1)]
    if streams.hand_pose is not None:
        chosen = chosen[streams.hand_pose.held(instants[chosen]) >= 0]
    if len(chosen) == 0:
        return None
    distances = np.array(
        [_distances(evidence, trajectory.poses[i], instants[i], joints[i]) for i in chosen.tolist()]
    )
    return bits[chosen] > 0.5, distances, what


def _distances(
    evidence: Evidence, T_wo: gtsam.Pose3, instant: int, joints: np.ndarray
) -> np.ndarray:
    """How far each pad's face is from the surface [m], shape (K,)."""
    hand, obj, stream = evidence.hand, evidence.object, evidence.streams.hand_pose
    assert hand is not None and obj is not None
    T_wh = None if stream is None else stream.poses[int(stream.held(np.array([instant]))[0])]
    points_w, offsets = hand.pad_points(joints, T_wh)
    matrix = T_wo.matrix()
    points_o = (points_w - matrix[:3, 3]) @ matrix[:3, :3]
    values = np.abs(obj.sdf.value(points_o))
    return np.array([values[a:b].min() for a, b in zip(offsets, offsets[1:], strict=False)])


def _advice(evidence: Evidence) -> str:
    if evidence.streams.hand_pose is not None:
        return "are hand and object given in one frame, and are joints and pads those of this hand?"
    where = (
        f"there is no topic {evidence.topics.hand_pose}, so that the hand is taken to stand at the world's "
        "origin; give the hand's pose as 'hand_pose' in the topic map"
    )
    if any(topic.split("/")[-1] in ("tf", "tf_static") for topic in evidence.present):
        where += " (what is only in /tf is not read: republish it as a PoseStamped)"
    return where
