# SPDX-License-Identifier: MIT
"""Joint values that the hand cannot reach: degrees, millimetres, or another zero."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from .evidence import Evidence
from .finding import Finding

if TYPE_CHECKING:
    from ...hands.model import HandModel

HINGE_TOLERANCE = 0.3  # [rad], encoders' zeros are off by less
SLIDE_TOLERANCE = 0.02  # [m]


def check_ranges(evidence: Evidence) -> Iterator[Finding]:
    """The joint that goes furthest beyond its range, if one does.

    Hinges without limits may turn once either way; slides without limits may go anywhere.
    """
    stream, hand = evidence.streams.joints, evidence.hand
    if stream is None or hand is None:
        return
    known = [name for name in hand.joint_names if name in stream.columns]
    beyond = {name: _furthest(stream.columns[name][1], hand, name) for name in known}
    outside = {name: found for name, found in beyond.items() if found[0] > 0}
    if not outside:
        return
    worst = max(outside, key=lambda name: outside[name][0])
    others = f" (and {len(outside) - 1} more)" if len(outside) > 1 else ""
    sentence = f"joint {worst}{others} {_sentence(outside[worst][1], hand, worst)}"
    yield Finding("joint beyond its range", sentence, "problem", worst)


def _furthest(values: np.ndarray, hand: HandModel, name: str) -> tuple[float, float]:
    """How far beyond range and tolerance a joint goes, in tolerances, and the value there."""
    tolerance = SLIDE_TOLERANCE if slides(hand, name) else HINGE_TOLERANCE
    low, high = _range(hand, name)
    excess = np.maximum(low - values, values - high) / tolerance - 1
    index = int(np.argmax(excess))
    return float(excess[index]), float(values[index])


def _range(hand: HandModel, name: str) -> tuple[float, float]:
    joint = hand.model.joint(name)
    turn = np.inf if slides(hand, name) else 2 * np.pi
    if not hand.model.jnt_limited[joint.id]:
        return -turn, turn
    low, high = hand.model.jnt_range[joint.id].tolist()
    return low, high


def slides(hand: HandModel, name: str) -> bool:
    """Whether a joint is a slide, in metres, and no hinge."""
    import mujoco

    return bool(hand.model.jnt_type[hand.model.joint(name).id] == mujoco.mjtJoint.mjJNT_SLIDE)


def _sentence(value: float, hand: HandModel, name: str) -> str:
    low, high = _range(hand, name)
    if slides(hand, name):
        unit, question, large = "m", "are these millimetres?", 1.0
    else:
        unit, question, large = "rad", "are these degrees?", np.pi
    if abs(value) < large:
        question = "is its zero or its sign another one?"
    return f"goes to {value:.3g} {unit}, its range is {low:.2f} to {high:.2f}: {question}"
