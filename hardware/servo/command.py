# SPDX-License-Identifier: MIT
"""Which commanded positions are allowed. A wrong one is refused, never clipped: it is a mistake."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from .description import HandDescription, Joint
from .errors import CommandError
from .state import StateTracker

MAX_AGE = 0.1  # [s], of the position a step is measured from


def by_joint(
    description: HandDescription, positions: Mapping[str, float] | ArrayLike
) -> dict[str, float]:
    """Commanded angles [rad] by joint name, from such a mapping or an array in joint order."""
    names = description.joint_names
    if isinstance(positions, Mapping):
        if unknown := sorted(set(positions) - set(names)):
            raise CommandError(f"no joints {', '.join(unknown)}; there are: {', '.join(names)}")
        return {name: float(angle) for name, angle in positions.items()}
    angles = np.asarray(positions, dtype=float)
    if angles.shape != (len(names),):
        raise CommandError(f"need {len(names)} angles, got an array of shape {angles.shape}")
    return dict(zip(names, angles.tolist(), strict=True))


def check(
    description: HandDescription, tracker: StateTracker, angles: Mapping[str, float], now: float
) -> None:
    """See that a command breaks no rule.

    Args:
        description: The hand.
        tracker: Where its joints are.
        angles: Commanded angles [rad], by joint name.
        now: Monotonic time [s].

    Raises:
        CommandError: It does; every joint concerned is named.
    """
    wrong = []
    for index, joint in enumerate(description.joints):
        if joint.name in angles:
            age, here = tracker.age(index, now), tracker.position(index)
            wrong.append(_wrong(joint, angles[joint.name], here, age, description.max_step))
    if refused := [text for text in wrong if text]:
        raise CommandError("; ".join(refused))


def _wrong(joint: Joint, angle: float, here: float, age: float, max_step: float) -> str:
    """What is wrong with one joint's command, or an empty string."""
    low, high = joint.limits
    if not math.isfinite(angle):
        return f"{joint.label}: {angle} is no angle"
    if not low <= angle <= high:
        return f"{joint.label}: {angle:.3f} rad is outside {low} to {high}"
    if age > MAX_AGE:
        return f"{joint.label}: its position is {age:.2f} s old; call state() before command()"
    if abs(angle - here) > max_step:
        return (
            f"{joint.label}: {angle:.3f} rad is {abs(angle - here):.2f} rad from where it is; at "
            f"most {max_step} are allowed at once"
        )
    return ""
