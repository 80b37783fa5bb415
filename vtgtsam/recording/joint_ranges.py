# SPDX-License-Identifier: MIT
"""Joint values that the hand cannot reach: degrees, millimetres, or another zero."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..hands.model import HandModel
    from .named import NamedStream

HINGE_TOLERANCE = 0.3  # [rad], encoders' zeros are off by less
SLIDE_TOLERANCE = 0.02  # [m]


def joints_beyond_range(stream: NamedStream, hand: HandModel) -> list[str]:
    """A sentence on the joint that goes furthest beyond its range, if one does.

    Hinges without limits may turn once either way; slides without limits may go anywhere.

    Args:
        stream: Values [rad or m] of all the hand's joints.
        hand: The hand, whose file has the ranges.
    """
    beyond = {name: _furthest(stream.columns[name][1], hand, name) for name in hand.joint_names}
    outside = {name: found for name, found in beyond.items() if found[0] > 0}
    if not outside:
        return []
    worst = max(outside, key=lambda name: outside[name][0])
    others = f" (and {len(outside) - 1} more)" if len(outside) > 1 else ""
    return [f"joint {worst}{others} {_sentence(outside[worst][1], hand, worst)}"]


def _furthest(values: np.ndarray, hand: HandModel, name: str) -> tuple[float, float]:
    """How far beyond range and tolerance a joint goes, in tolerances, and the value there."""
    tolerance = SLIDE_TOLERANCE if _slides(hand, name) else HINGE_TOLERANCE
    low, high = _range(hand, name)
    excess = np.maximum(low - values, values - high) / tolerance - 1
    index = int(np.argmax(excess))
    return float(excess[index]), float(values[index])


def _range(hand: HandModel, name: str) -> tuple[float, float]:
    joint = hand.model.joint(name)
    turn = np.inf if _slides(hand, name) else 2 * np.pi
    if not hand.model.jnt_limited[joint.id]:
        return -turn, turn
    low, high = hand.model.jnt_range[joint.id].tolist()
    return low, high


def _slides(hand: HandModel, name: str) -> bool:
    import mujoco

    return bool(hand.model.jnt_type[hand.model.joint(name).id] == mujoco.mjtJoint.mjJNT_SLIDE)


def _sentence(value: float, hand: HandModel, name: str) -> str:
    low, high = _range(hand, name)
    if _slides(hand, name):
        unit, question, large = "m", "are these millimetres?", 1.0
    else:
        unit, question, large = "rad", "are these degrees?", np.pi
    if abs(value) < large:
        question = "is its zero or its sign another one?"
    return f"goes to {value:.3g} {unit}, its range is {low:.2f} to {high:.2f}: {question}"
