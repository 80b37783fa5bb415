# SPDX-License-Identifier: MIT
"""The hand against the object: what a pad touches is where the pad is, and in front of its face."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import gtsam
import numpy as np

from .evidence import Evidence
from .finding import Finding

TRUE = "the true pose"
MOST_FRAMES = 60  # with contact that are looked at
FEWEST = 5  # frames with contact that say something
FAR = 0.05  # [m], the nearest touching pad from the surface: the hand is elsewhere
OFF = 0.008  # [m], of one pad: a few millimetres are what joints' zeros and the truth are off by
OFF_SEEN = 0.02  # [m], by a tracker's poses, where most pads are nearer than OFF
PAST = np.deg2rad(75)  # between a face and what it touches
INSIDE = 0.0005  # [m], deeper in a thin wall its other side may be the nearer one


@dataclass(frozen=True, eq=False)
class _Touches:
    """Pads against the surface in F frames in which some pad touches.

    Attributes:
        bits: Whether each of K pads touches, shape (F, K).
        distances: Signed distance of its nearest point [m], shape (F, K).
        angles: Between its +z and the way into the object there [rad], shape (F, K).
        by: By which pose.
    """

    bits: np.ndarray
    distances: np.ndarray
    angles: np.ndarray
    by: str

    def off(self, k: int) -> float:
        """Usual distance of a touching pad to the surface [m]; NaN where it touches too seldom."""
        return _median(np.abs(self.distances[self.bits[:, k], k]))

    def mostly_near(self) -> bool:
        """Whether more pads are near where they touch than away from it."""
        off = np.array([self.off(k) for k in range(self.bits.shape[1])])
        return bool((off < OFF).sum() > (off > OFF_SEEN).sum())

    def angle(self, k: int) -> float:
        """Usual angle between a touching pad and the way into the object [rad]; NaN as above."""
        touches = self.bits[:, k] & (self.distances[:, k] > -INSIDE)
        return _median(self.angles[touches, k])


def _median(values: np.ndarray) -> float:
    return float(np.median(values)) if len(values) >= FEWEST else float("nan")


def check_held(evidence: Evidence) -> Iterator[Finding]:
    """A hand that is not where its pads touch the object, or one pad that is not."""
    touches = _touches(evidence)
    if touches is None or len(touches.bits) < FEWEST:
        return
    distances = np.where(touches.bits, np.abs(touches.distances), np.nan)
    nearest = float(np.median(np.nanmin(distances, axis=1)))
    if nearest > FAR:
        yield Finding(
            "hand far from the object",
            f"while pads touch, the nearest of them is {1e3 * nearest:.0f} mm from the object (median, by "
            f"{touches.by}): {_advice(evidence)}",
            "problem",
        )
        return
    assert evidence.hand is not None
    far = OFF
    if touches.by != TRUE:
        far = OFF_SEEN if touches.mostly_near() else np.inf  # a tracker may be so far off
    for k, name in enumerate(evidence.hand.pad_names):
        if touches.off(k) > far:
            yield Finding(
                "pad touches nothing",
                f"pad {name} touches while it is {1e3 * touches.off(k):.0f} mm from the object (median, by "
                f"{touches.by}); check its place and its name in the hand's file, its bit, and the "
                "joints' zeros",
                "warning",
                name,
            )
        elif touches.by == TRUE and touches.angle(k) > PAST:
            yield Finding(
                "pad looks past what it touches",
                f"pad {name} looks past what it touches by {np.rad2deg(touches.angle(k)):.0f} degrees "
                f"(median, by {touches.by}); does it stand on edge, or look into its link? +z points out "
                "of the face that touches",
                "warning",
                name,
            )


def _touches(evidence: Evidence) -> _Touches | None:
    """What pads do in some frames in which one touches, by the best pose there is; None without one."""
    hand, obj, streams = evidence.hand, evidence.object, evidence.streams
    truth, vision = evidence.truth, evidence.vision
    trajectory, by = (truth, TRUE) if truth is not None else (vision, "the visual pose")
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
    nearest = [
        _nearest(evidence, trajectory.poses[i], instants[i], joints[i]) for i in chosen.tolist()
    ]
    distances, angles = np.array(nearest).transpose(1, 0, 2)
    return _Touches(bits[chosen] > 0.5, distances, angles, by)


def _nearest(
    evidence: Evidence, T_wo: gtsam.Pose3, instant: int, joints: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Signed distance of each pad's nearest point [m], and the angle from +z into the object [rad], (K,) each."""
    hand, obj, stream = evidence.hand, evidence.object, evidence.streams.hand_pose
    assert hand is not None and obj is not None
    T_wh = None if stream is None else stream.poses[int(stream.held(np.array([instant]))[0])]
    points_w, offsets = hand.pad_points(joints, T_wh)
    matrix = T_wo.matrix()
    points_o = (points_w - matrix[:3, 3]) @ matrix[:3, :3]
    values = obj.sdf.value(points_o)
    first = [a + int(np.argmin(values[a:b])) for a, b in zip(offsets, offsets[1:], strict=False)]
    _, outward_o = obj.sdf.value_and_gradient(points_o[first])
    normals_o = hand.pad_transforms(joints, T_wh)[:, :3, 2] @ matrix[:3, :3]
    length = np.maximum(np.linalg.norm(outward_o, axis=1), 1e-12)
    cosines = -(normals_o * outward_o).sum(axis=1) / length
    return values[first], np.arccos(np.clip(cosines, -1, 1))


def _advice(evidence: Evidence) -> str:
    if evidence.streams.hand_pose is not None:
        return "are hand and object given in one frame, and are joints and pads those of this hand?"
    where = (
        f"there is no topic {evidence.topics.hand_topic}, so that the hand is taken to stand at the world's "
        "origin; give the hand's pose as 'hand_pose' in the topic map"
    )
    if any(topic.split("/")[-1] in ("tf", "tf_static") for topic in evidence.present):
        where += " (what is only in /tf is not read: republish it as a PoseStamped)"
    return where
