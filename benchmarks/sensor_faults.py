# SPDX-License-Identifier: MIT
"""Sensors that fail from the middle of a recording on, each with the words that name it and when it begins to show.

"From when on it shows" is judged by the truth: a hand that is frozen shows nothing while it would stand still anyway, a
pad that is stuck nothing while it would touch anyway. The estimator knows nothing of that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import gtsam
import numpy as np
import trimesh

from vtgtsam import Measurement, ObjectModel, build_sdf
from vtgtsam.faults import words
from vtgtsam.frame import contact_bits, joints_of
from vtgtsam.objects import mesh_of
from vtgtsam.sdf.search import ClosestPoints
from vtgtsam.sdf.search.closest_points import PadContacts

from .disturbances import about_centre
from .replay import Replay

BEGIN = 6.0  # [s], amid the turn
MOVED = (
    np.deg2rad(10.0),
    0.010,
)  # [rad], [m] that an object must move from a frozen hand to show it
FAR = 0.012  # [m], a pad so far from the object does not touch it
TOUCHING = 3  # pads, that an object must touch to show that it is another one ...
OPPOSITE = -0.5  # ... with so small a cosine between the surface's normals at two of them
LATE = 0.6  # [s]
SCALE = 1.3  # of the wrong object

Change = Callable[[int], Measurement]  # from a frame's number to the frame with the fault


@dataclass(frozen=True)
class SensorFault:
    """One way to fail.

    Attributes:
        named: Words of which any one names it.
        spoil: What it makes of a replay's frames.
        shows: The instant [s] from which on its streams could show it; None where they never do.
        until: When it ends [s].
        stream: Which stream it spoils, "vision", "touch" or "object".
    """

    named: tuple[str, ...]
    spoil: Callable[[Replay], Change]
    shows: Callable[[Replay], float | None]
    stream: str
    until: float = np.inf

    def frames(self, replay: Replay) -> list[Measurement]:
        """The replay's frames with the fault."""
        change = self.spoil(replay)
        return [
            change(n) if BEGIN <= frame.time < self.until else frame
            for n, frame in enumerate(replay.frames)
        ]


def at_once(replay: Replay) -> float | None:
    """It shows in the first frame."""
    return _first(replay, np.ones(len(replay.frames), dtype=bool))


def seen(replay: Replay) -> float | None:
    """It shows in the first frame with a visual pose."""
    return _first(replay, np.array([f.T_wo_visual is not None for f in replay.frames]))


def seen_moving(replay: Replay) -> float | None:
    """It shows once the object has moved from where it was when the hand froze, and is seen."""
    T_then = replay.truths[first_frame(replay)]
    steps = [T_then.between(T_true) for T_true in replay.truths]
    moved = [
        np.linalg.norm(T.translation()) > MOVED[1]
        or np.linalg.norm(gtsam.Rot3.Logmap(T.rotation())) > MOVED[0]
        for T in steps
    ]
    visible = [frame.T_wo_visual is not None for frame in replay.frames]
    return _first(replay, np.array(moved) & np.array(visible))


def gripped(replay: Replay) -> float | None:
    """It shows once pads touch the object on opposite sides: then it cannot be elsewhere, only another one."""
    at = closest_at_truth(replay)
    shown = [_grips(_bits(replay, n), at(n).jacobians[:, 3:]) for n in range(len(replay.frames))]
    return _first(replay, np.array(shown), since=0.0)


def _grips(bits: np.ndarray, inwards: np.ndarray) -> bool:
    if np.count_nonzero(bits) < TOUCHING:
        return False
    normals = inwards[bits] / np.maximum(np.linalg.norm(inwards[bits], axis=1), 1e-9)[:, None]
    return bool((normals @ normals.T).min() < OPPOSITE)


def first_frame(replay: Replay) -> int:
    """Number of the first frame with the fault."""
    return int(np.searchsorted(replay.times, BEGIN))


def _first(replay: Replay, shown: np.ndarray, since: float = BEGIN) -> float | None:
    found = np.flatnonzero(shown & (replay.times >= since))
    return float(replay.times[found[0]]) if len(found) else None


def _bits(replay: Replay, n: int) -> np.ndarray:
    return contact_bits(replay.frames[n].contacts, replay.recording.hand.pad_names)


def _joints(replay: Replay, n: int) -> np.ndarray:
    return joints_of(replay.frames[n], replay.recording.hand)


def _vision(change: Callable[[gtsam.Pose3], gtsam.Pose3]) -> Callable[[Replay], Change]:
    """The visual pose changed, where there is one."""

    def spoil(replay: Replay) -> Change:
        def spoiled(n: int) -> Measurement:
            frame = replay.frames[n]
            if frame.T_wo_visual is None:
                return frame
            return replace(frame, T_wo_visual=change(frame.T_wo_visual))

        return spoiled

    return spoil


def _flipped(replay: Replay) -> Change:
    turn = about_centre(replay, gtsam.Rot3.Rx(np.pi))
    return _vision(lambda T_wo: T_wo.compose(turn))(replay)


def _frozen_vision(replay: Replay) -> Change:
    last = [f for f in replay.frames[: first_frame(replay)] if f.T_wo_visual is not None][-1]
    T_wo, covariance = last.T_wo_visual, last.visual_covariance
    return lambda n: replace(replay.frames[n], T_wo_visual=T_wo, visual_covariance=covariance)


def _late_vision(replay: Replay) -> Change:
    return lambda n: replace(replay.frames[n], visual_time=replay.frames[n].time - LATE)


def _frozen_hand(replay: Replay) -> Change:
    then = replay.frames[first_frame(replay)]
    return lambda n: replace(replay.frames[n], joints=then.joints, T_wh=then.T_wh)


def _joints_as(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Replay], Change]:
    return lambda replay: lambda n: replace(replay.frames[n], joints=change(_joints(replay, n)))


def _inverted(replay: Replay) -> Change:
    return lambda n: replace(replay.frames[n], contacts=~_bits(replay, n))


def _stuck(replay: Replay) -> Change:
    pad = np.arange(len(replay.recording.hand)) == far_pad(replay)[0]
    return lambda n: replace(replay.frames[n], contacts=_bits(replay, n) | pad)


def _flickering(replay: Replay) -> Change:
    pad = np.arange(len(replay.recording.hand)) == 0
    return lambda n: replace(replay.frames[n], contacts=np.where(pad, n % 2 == 0, _bits(replay, n)))


def _as_it_is(replay: Replay) -> Change:
    return replay.frames.__getitem__


def closest_at_truth(replay: Replay) -> Callable[[int], PadContacts]:
    """By a frame's number, all pads' closest points to the object at the truth, the joints as they are measured."""
    hand = replay.recording.hand
    closest = ClosestPoints(hand, replay.recording.object.sdf)
    everywhere = np.ones(len(hand), dtype=bool)

    def at(n: int) -> PadContacts:
        frame = replay.frames[n]
        T_wp = hand.pad_transforms(joints_of(frame, hand), frame.T_wh)
        return closest.search(np.ascontiguousarray(replay.truths[n].matrix()), T_wp, everywhere)

    return at


def far_pad(replay: Replay) -> tuple[int, float]:
    """The pad that is farthest from the object when the fault begins, and how far it is [m]."""
    distances = closest_at_truth(replay)(first_frame(replay)).distances
    pad = int(np.argmax(distances))
    return pad, float(distances[pad])


def _far(replay: Replay) -> float | None:
    """It shows while the stuck pad is far from the object."""
    return at_once(replay) if far_pad(replay)[1] > FAR else None


def wrong_object(replay: Replay) -> ObjectModel:
    """The object, 30 % larger than it is."""
    obj = replay.recording.object
    mesh: trimesh.Trimesh = mesh_of(obj).copy()
    mesh.apply_scale(SCALE)
    return ObjectModel("wrong", build_sdf(mesh, resolution=96), mesh)


FROM_VISION = (words.VISION_JUMPS, words.VISION_FAR)

FAULTS: dict[str, SensorFault] = {
    "vision frozen": SensorFault((words.VISION_REPEATS,), _frozen_vision, at_once, "vision"),
    "vision off by 100 mm": SensorFault(
        FROM_VISION,
        _vision(lambda T: gtsam.Pose3(T.rotation(), T.translation() + [0.1, 0.0, 0.0])),
        seen,
        "vision",
    ),
    "vision in millimetres": SensorFault(
        (words.VISION_MILLIMETRES,),
        _vision(lambda T: gtsam.Pose3(T.rotation(), 1e3 * T.translation())),
        seen,
        "vision",
    ),
    "vision flipped": SensorFault(FROM_VISION, _flipped, seen, "vision"),
    "vision not finite": SensorFault(
        (words.VISION_NOT_FINITE,),
        _vision(lambda T: gtsam.Pose3(T.rotation(), np.full(3, np.nan))),
        seen,
        "vision",
    ),
    "vision 0.6 s late": SensorFault(
        (words.VISION_TOO_LATE,),
        _late_vision,
        seen,
        "vision",
    ),
    "contacts inverted": SensorFault((words.CONTACTS_INVERTED,), _inverted, at_once, "touch"),
    "a far pad stuck": SensorFault(("pad",), _stuck, _far, "touch"),
    "a pad flickers": SensorFault(("flickers",), _flickering, at_once, "touch"),
    "hand frozen": SensorFault((words.HAND_FROZEN,), _frozen_hand, seen_moving, "touch"),
    "joints in degrees": SensorFault(
        (words.JOINTS_DEGREES,), _joints_as(np.rad2deg), at_once, "touch"
    ),
    "joints beyond their range": SensorFault(
        (words.JOINTS_OUT_OF_RANGE,), _joints_as(lambda q: q + 2.0), at_once, "touch"
    ),
    "joints not finite, 2 s": SensorFault(
        (words.JOINTS_NOT_FINITE,),
        _joints_as(lambda q: np.full_like(q, np.nan)),
        at_once,
        "touch",
        until=BEGIN + 2.0,
    ),
    "wrong object": SensorFault((words.NO_FIT,), _as_it_is, gripped, "object"),
}


def blind(frames: Sequence[Measurement]) -> list[Measurement]:
    """Frames without vision from the fault's begin on."""
    return [
        replace(f, T_wo_visual=None, visual_covariance=None, visual_time=None)
        if f.time >= BEGIN
        else f
        for f in frames
    ]


def names(fault: SensorFault, faults: Sequence[str]) -> bool:
    """Whether an estimate's faults name it."""
    return any(word in said for word in fault.named for said in faults)
