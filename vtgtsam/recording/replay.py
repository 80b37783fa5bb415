# SPDX-License-Identifier: MIT
"""A live run's frames once more: at the instants that it fused, with what had been received by then.

Log times say when something became known, and an estimate's is the moment at which its frame was cut out of what was
known. So a frame knows the samples that were logged before it, late ones among them, and takes the visual pose that the
live run's queue gave it.
"""

from __future__ import annotations

import gtsam
import numpy as np

from ..hands.model import HandModel
from ..live.vision import VisionQueue, VisualPose
from ..measurement import Measurement
from .align import Streams
from .named import last_known
from .poses import SAME, PoseStream


def replayed(
    streams: Streams, hand: HandModel, warnings: list[str], hold_ns: int
) -> list[Measurement]:
    """The frames of a live run.

    Args:
        streams: With joints, contacts and estimates.
        hand: Names the joints and pads.
        warnings: Gets a sentence for frames that cannot be made.
        hold_ns: How long a visual pose counted again [ns].
    """
    assert streams.joints is not None and streams.contacts is not None
    estimates = streams.estimate
    assert estimates is not None and estimates.received_ns is not None
    instants_ns, known_ns = estimates.times_ns, estimates.received_ns
    joints = streams.joints.held_knowing(instants_ns, known_ns, hand.joint_names)
    contacts = streams.contacts.held_knowing(instants_ns, known_ns, hand.pad_names)
    hands = _hand_poses(streams.hand_pose, instants_ns, known_ns)
    visual = _visual_poses(streams.vision_sent, instants_ns, known_ns, hold_ns)
    frames = []
    for i in range(len(instants_ns)):
        T_wh, seen = hands[i], visual[i]
        if T_wh is None or not np.isfinite([*joints[i], *contacts[i]]).all():
            continue
        frames.append(
            Measurement(
                time=int(instants_ns[i]) / 1e9,
                contacts=contacts[i] > 0.5,
                joints=joints[i],
                T_wo_visual=None if seen is None else seen.T_wo,
                T_wh=T_wh,
                visual_covariance=None if seen is None else seen.covariance,
                visual_correlation=0.0 if seen is None else seen.correlation,
                visual_time=None if seen is None else seen.stamp_ns / 1e9,
            )
        )
    if len(frames) < len(instants_ns):
        warnings.append(
            f"{len(instants_ns) - len(frames)} of {len(instants_ns)} recorded instants are skipped: the recording "
            "does not hold the joints, contacts and hand pose that were known then"
        )
    return frames


def _hand_poses(
    stream: PoseStream | None, instants_ns: np.ndarray, known_ns: np.ndarray
) -> list[gtsam.Pose3 | None]:
    """The hand's pose for each frame: as long as all that came were one, that one, whatever its stamp.

    Before the first it is taken to stand at the world's origin.
    """
    if stream is None:
        return [gtsam.Pose3()] * len(instants_ns)
    received_ns = stream.times_ns if stream.received_ns is None else stream.received_ns
    order = np.argsort(received_ns, kind="stable")
    first = stream.poses[int(order[0])]
    others = [int(i) for i in order if not stream.poses[int(i)].equals(first, SAME)]
    moves_ns = received_ns[others[0]] if others else np.iinfo(np.int64).max
    held = last_known(stream.times_ns, received_ns, instants_ns, known_ns)
    poses: list[gtsam.Pose3 | None] = []
    for index, known in zip(held.tolist(), known_ns.tolist(), strict=True):
        if known < moves_ns:
            poses.append(first if known >= received_ns[order[0]] else gtsam.Pose3())
        else:
            poses.append(stream.poses[index] if index >= 0 else None)
    return poses


def _visual_poses(
    stream: PoseStream | None, instants_ns: np.ndarray, known_ns: np.ndarray, hold_ns: int
) -> list[VisualPose | None]:
    """The visual pose that each frame took."""
    queue = VisionQueue(hold_ns)
    coming = [] if stream is None else _as_received(stream)
    next_one = 0
    taken: list[VisualPose | None] = []
    for instant, known in zip(instants_ns.tolist(), known_ns.tolist(), strict=True):
        while next_one < len(coming) and coming[next_one][0] <= known:
            queue.put(coming[next_one][1])
            next_one += 1
        first = queue.begin(instant) if not taken else None
        taken.append(queue.take(instant) if first is None else first)
    return taken


def _as_received(stream: PoseStream) -> list[tuple[int, VisualPose]]:
    """Visual poses in the order of their receipt, its instant first."""
    received_ns = stream.times_ns if stream.received_ns is None else stream.received_ns
    order = np.argsort(received_ns, kind="stable").tolist()
    return [
        (
            int(received_ns[i]),
            VisualPose(
                int(stream.times_ns[i]),
                stream.poses[i],
                stream.covariances[i],
                stream.correlation(i),
            ),
        )
        for i in order
    ]
