# SPDX-License-Identifier: MIT
"""Which grasps are of use, and which of these agree with each other; of the others, why not."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..config import EstimatorConfig
from ..faults import words
from .consistency import nees
from .keyframes import Grasp
from .residuals import Residuals, residuals
from .solve import SETTLED, Belief, Solved, solve
from .sources import none_of_use
from .touches import Felt

FEWEST_SEEN = 0.7  # share of the visual poses that memory must have believed: a lost tracker's others are off, too
SHORTEST = 1.0  # [s], with a pad that touches
MOST_NEES = 4.0  # a grasp this far from the others is of something else
MOST_CONTACT = 0.0025  # [m], touching pads that stay so far from the surface touch something else


class Used(NamedTuple):
    """A grasp that the calibration was made from.

    Attributes:
        name: What its recording is called.
        residuals: What is left over in it.
        nees: How far it is from the others, in units of what both are unsure of; about 1.
        keyframes: How many frames of it were used.
    """

    name: str
    residuals: Residuals
    nees: float
    keyframes: int


def useless(grasp: Grasp) -> str:
    """Why a grasp can say nothing; empty where it can."""
    because = f" ({', '.join(grasp.faults)})" if grasp.faults else ""
    if words.NO_FIT in grasp.faults:
        return f"nowhere does the mesh fit the pads that touch: another object, or another scale{because}"
    if len(grasp.keyframes) * grasp.spacing < SHORTEST:
        return f"no pad touches for as long as a second while the object is tracked{because}"
    if grasp.seen < FEWEST_SEEN:
        return (
            f"{1 - grasp.seen:.0%} of its visual poses contradict touch and memory: the tracker had lost the "
            f"object, or the object is not the mesh{because}"
        )
    return ""


def odd(used: Used) -> str:
    """What speaks against a grasp once the offsets are solved for; empty where nothing does."""
    if used.residuals.contact > MOST_CONTACT:
        return (
            f"touching pads stay {1e3 * used.residuals.contact:.1f} mm from the object's surface: "
            "another object than the mesh, another scale, or a tracker that had lost it"
        )
    if used.nees > MOST_NEES:
        return (
            f"it contradicts the others (NEES {used.nees:.1f}, about 1 is right): another object than the mesh, "
            "a tracker that sat beside the object, or another robot"
        )
    return ""


def used_of(grasp: Grasp, number: int, solved: Solved, camera_origin: np.ndarray) -> Used:
    """How grasp ``number`` of a solution fits it."""
    said = solved.said[number]
    left = residuals(grasp, number, solved.values, camera_origin)
    apart = nees(said.information, said.pull, solved.belief.covariance)
    return Used(grasp.name, left, apart, len(grasp.keyframes))


def helpful(grasps: Sequence[Grasp]) -> tuple[list[Grasp], dict[str, str]]:
    """Grasps that can say something, and why the others cannot.

    Raises:
        CalibrationError: None can.
    """
    left_out = {grasp.name: reason for grasp in grasps if (reason := useless(grasp))}
    chosen = [grasp for grasp in grasps if grasp.name not in left_out]
    return _any_of(chosen, left_out), left_out


class Agreed(NamedTuple):
    """Grasps that agree with each other, and what they say.

    Attributes:
        solved: The solution of these alone.
        grasps: The grasps.
        used: How each of them fits.
        left_out: Why the others do not agree, by their names.
    """

    solved: Solved
    grasps: list[Grasp]
    used: list[Used]
    left_out: dict[str, str]


def agreeing(
    grasps: Sequence[Grasp],
    known: Belief,
    start: np.ndarray,
    camera_origin: np.ndarray,
    config: EstimatorConfig,
    touches: Sequence[Felt] = (),
    settled: float = SETTLED,
) -> Agreed:
    """The grasps left when the oddest one is taken out, and solved for again, until none is odd.

    Args:
        grasps: Grasps that can say something, each under a name of its own.
        known: What was known of the offsets before.
        start: Where the solver starts with them, shape (6 + J,), or several of those.
        camera_origin: The point that the camera's twist turns about, in the world [m], shape (3,).
        config: As the estimator's that tracked the grasps.
        touches: Touches of the hand with itself.
        settled: As ``solve`` takes it.

    Raises:
        CalibrationError: None is left.
    """
    chosen = list(grasps)
    left_out: dict[str, str] = {}
    while True:
        some = _any_of(chosen, left_out)
        solved = solve(some, known, start, camera_origin, config, touches, settled)
        used = [used_of(grasp, n, solved, camera_origin) for n, grasp in enumerate(chosen)]
        oddest = max(range(len(used)), key=lambda n: _oddness(used[n]))
        reason = odd(used[oddest])
        if not reason:
            return Agreed(solved, chosen, used, left_out)
        left_out[chosen.pop(oddest).name] = reason


def _oddness(used: Used) -> float:
    return max(used.nees / MOST_NEES, used.residuals.contact / MOST_CONTACT)


def _any_of(grasps: list[Grasp], left_out: dict[str, str]) -> list[Grasp]:
    """The grasps, of which there must be some."""
    if not grasps:
        raise none_of_use(left_out)
    return grasps
