# SPDX-License-Identifier: MIT
"""Touches of a hand's thumb against its fingers, pad to pad, that calibrate its joints: planned, and carried out.

A grasp sees sums of a finger's joint zeros; two pads that touch each other, with the finger bent in many ways, see more
(after Tenhumberg, Sievers, Baeuml 2023). A plan is made from the hand's model alone. Each touch approaches a pose in
which, by the model, the pads meet face to face, and closes one joint slowly until both report contact, for the zeros
are not known yet.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

import mujoco
import numpy as np

from ..exceptions import HandError
from ..factors.pad_touch import touch_residual
from ..hands.model import HandModel
from .description import GraspDescription

FACING = -0.7  # cosine of the angle between the pads' normals, at most: face to face
ASIDE = 0.6  # share of a pad's half lengths by which centres may be apart
NORMALS = 0.03  # [m], normals that differ by 1 count as so far apart
NEAR = 0.01  # [m], pads that are closer are brought together
MEETING = 1e-4  # [m]
MARGIN = 0.05  # [rad], to joints' limits
OPEN, BEYOND = (
    0.012,
    0.009,
)  # [m], before the last joint closes, and after the model's touch, before giving up
TRIES = 300  # poses that are looked for
ZERO_SIGMA, TOUCH_SIGMA = np.deg2rad(1.0), 0.0005  # [rad], [m], what a plan reckons with

FAST, SLOW = 1.2, 0.15  # [rad/s], to the approach, and while it closes
LEAD = (
    0.1  # [rad], the command's largest lead over the measured angle while it closes: a gentle touch
)
SETTLE = 0.3  # [s], the approach is kept for so long, and the touch


class Touch(NamedTuple):
    """A touch to make.

    Attributes:
        a: Index of the thumb's pad.
        b: Index of the finger's pad.
        joints: Where they touch, by the model [rad], shape (J,).
        last: Index of the joint that closes until they do.
        slope: By how much they come apart as it turns [m/rad].
    """

    a: int
    b: int
    joints: np.ndarray
    last: int
    slope: float

    def at(self, gap: float) -> np.ndarray:
        """Joint angles with the pads so far apart [m], or so far into each other, by the model [rad], shape (J,)."""
        joints = self.joints.copy()
        joints[self.last] += gap / self.slope
        return joints


def plan_touches(
    hand: HandModel, description: GraspDescription, count: int = 12, seed: int = 0
) -> list[Touch]:
    """Touches that together say most of the joints' zeros, the most telling one first.

    Args:
        hand: The hand.
        description: Which joints are the thumb's and the fingers', and where they are in the open hand.
        count: How many.
        seed: Of the poses that are tried.

    Raises:
        HandError: The hand has no thumb, or none of its pads reaches a finger's.
    """
    if not description.thumb:
        raise HandError(f"hand {hand.name!r} has no thumb to touch its fingers with")
    found = list(_candidates(hand, description, np.random.default_rng(seed)))
    if not found:
        raise HandError(
            f"hand {hand.name!r}: no pose was found in which a pad of the thumb meets one of a finger, face to face"
        )
    rows = [touch_residual(hand, t.joints, np.zeros(len(t.joints)), t.a, t.b)[1] for t in found]
    P = ZERO_SIGMA**2 * np.eye(len(hand.joint_names))
    chosen: list[Touch] = []
    for _ in range(min(count, len(found))):
        told = [float(row @ P @ row) for row in rows]
        best = int(np.argmax(told))
        seen = P @ rows[best]
        P -= np.outer(seen, seen) / (told[best] + TOUCH_SIGMA**2)
        chosen.append(found[best])
    return chosen


def _candidates(
    hand: HandModel, description: GraspDescription, rng: np.random.Generator
) -> Iterator[Touch]:
    """Touches of the thumb and one finger, the other fingers open."""
    limits = _limits(hand)
    rest = np.array([description.start.get(name, 0.0) for name in hand.joint_names])
    data = mujoco.MjData(hand.model)
    thumb = _moved_by(hand, description.thumb)
    for k in range(TRIES):
        finger = description.fingers[k % len(description.fingers)]
        a = int(rng.choice(thumb))
        b = int(rng.choice(np.setdiff1d(_moved_by(hand, finger), thumb)))
        turning = _turning(hand, description, finger, a)
        joints = _facing(hand, rest, turning, a, b, limits, rng)
        touch = _met(hand, joints, a, b, turning, limits)
        if touch is not None and not _collides(hand, data, touch):
            yield touch


def _turning(
    hand: HandModel, description: GraspDescription, finger: Sequence[str], a: int
) -> np.ndarray:
    """Indices of the joints that turn for a touch: the finger's, and all that move the thumb's pad a and no finger."""
    chains = [name for chain in description.fingers for name in chain]
    of_fingers = hand.moves_pads[_moved_by(hand, chains)].any(axis=0)
    own = np.isin(hand.joint_names, finger)
    return np.flatnonzero(own | (hand.moves_pads[a] & ~of_fingers))


def _facing(
    hand: HandModel,
    rest: np.ndarray,
    turning: np.ndarray,
    a: int,
    b: int,
    limits: np.ndarray,
    rng: np.random.Generator,
) -> np.ndarray:
    """A pose with two pads face to face, or as nearly as is possible, from a random one [rad], shape (J,)."""
    from scipy.optimize import least_squares

    aside = np.append(ASIDE * rng.uniform(-0.5, 0.5, 2) * hand.pads[b].size, 0.0)

    def posed(angles: np.ndarray) -> np.ndarray:
        joints = rest.copy()
        joints[turning] = angles
        return joints

    def off(angles: np.ndarray) -> np.ndarray:
        T = hand.pad_transforms(posed(angles))
        meeting = T[b, :3, 3] + T[b, :3, :3] @ aside
        return np.concatenate([T[a, :3, 3] - meeting, NORMALS * (T[a, :3, 2] + T[b, :3, 2])])

    low, high = limits[turning].T
    found = least_squares(off, rng.uniform(low, high), bounds=(low, high), max_nfev=30)
    return posed(found.x)


def _met(
    hand: HandModel, joints: np.ndarray, a: int, b: int, turning: np.ndarray, limits: np.ndarray
) -> Touch | None:
    """The touch that turning one joint makes of a pose in which two pads are near; None where it makes none."""
    none = np.zeros(len(joints))
    slopes = -touch_residual(hand, joints, none, a, b)[1]  # by the angles themselves
    last = int(turning[np.argmax(np.abs(slopes[turning]))])
    joints = joints.copy()
    for _ in range(8):
        gap, row = touch_residual(hand, joints, none, a, b)
        if abs(gap) > NEAR or abs(row[last]) < 0.01:
            return None
        if abs(gap) < MEETING:
            break
        joints[last] += gap / row[last]
    T = hand.pad_transforms(joints)
    inside = (joints >= limits[:, 0]) & (joints <= limits[:, 1])
    if abs(gap) > MEETING or not inside.all() or T[a, :3, 2] @ T[b, :3, 2] > FACING:
        return None
    return Touch(a, b, joints, last, -float(row[last]))


def _collides(hand: HandModel, data: mujoco.MjData, touch: Touch) -> bool:
    """Whether other parts of the hand overlap in a touch, or shortly before."""
    for gap in (OPEN, OPEN / 2, 0.0):
        data.qpos[:] = touch.at(gap)
        mujoco.mj_kinematics(hand.model, data)
        mujoco.mj_comPos(hand.model, data)
        mujoco.mj_collision(hand.model, data)
        if (data.contact.dist < 0.0).any():
            return True
    return False


def _moved_by(hand: HandModel, joints: Sequence[str]) -> np.ndarray:
    """Indices of the pads that one of some joints moves."""
    chosen = [hand.joint_names.index(name) for name in joints]
    return np.flatnonzero(hand.moves_pads[:, chosen].any(axis=1))


def _limits(hand: HandModel) -> np.ndarray:
    """Lower and upper limit of each joint with a margin [rad], shape (J, 2)."""
    limited = hand.model.jnt_limited.astype(bool)[:, None]
    limits: np.ndarray = np.where(limited, hand.model.jnt_range, (-np.pi, np.pi))
    return limits + [MARGIN, -MARGIN]


State = Literal["approaching", "closing", "touching", "touched", "missed"]


class TouchController:
    """Makes one touch: joint angles and contacts in, commanded joint angles out.

    Args:
        touch: The touch.
        command: The angles commanded so far [rad], shape (J,).

    Attributes:
        state: How far it is; it ends with "touched" or "missed".
        joints: The measured angles while the pads touched, their mean [rad], shape (J,); once it is touched.
    """

    def __init__(self, touch: Touch, command: np.ndarray) -> None:
        self._touch = touch
        self._command = np.array(command, dtype=np.float64)
        self._since = 0.0  # how long what is waited for has held [s]
        self._felt: list[np.ndarray] = []
        self.state: State = "approaching"
        self.joints: np.ndarray | None = None

    @property
    def done(self) -> bool:
        """Whether the touch has been made, or given up."""
        return self.state in ("touched", "missed")

    def step(self, dt: float, joints: np.ndarray, touching: np.ndarray) -> np.ndarray:
        """The angles to command now [rad], shape (J,).

        Args:
            dt: Since the last call [s].
            joints: Measured angles [rad], shape (J,).
            touching: Which pads report contact, bool, shape (K,).
        """
        both = bool(touching[self._touch.a] and touching[self._touch.b])
        if self.state == "approaching":
            self._approach(dt, both)
        elif self.state in ("closing", "touching"):
            self._close(dt, joints, both)
        return self._command

    def _approach(self, dt: float, both: bool) -> None:
        way = self._touch.at(OPEN) - self._command
        self._command = self._command + np.clip(way, -FAST * dt, FAST * dt)
        self._since = 0.0 if way.any() else self._since + dt
        if self._since >= SETTLE:
            self.state, self._since = ("missed" if both else "closing"), 0.0

    def _close(self, dt: float, joints: np.ndarray, both: bool) -> None:
        if both:
            self.state = "touching"
            self._felt.append(joints.copy())
            self._since += dt
            if self._since >= SETTLE:
                self.joints, self.state = np.mean(self._felt, axis=0), "touched"
            return
        self._since = 0.0
        self._felt.clear()
        last, closes = self._touch.last, -np.sign(self._touch.slope)
        end = self._touch.at(-BEYOND)[last]
        if closes * (self._command[last] - end) > 0.0:
            self.state = "missed"
        elif closes * (self._command[last] - joints[last]) < LEAD:
            self._command = self._command.copy()
            self._command[last] += closes * SLOW * dt
