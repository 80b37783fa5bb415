# SPDX-License-Identifier: MIT
"""A calibration in words and tables, in millimetres and degrees."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from .calibrate import Calibrated
from .directions import CAMERA


def text_of(result: Calibrated) -> str:
    """What came of it, for people."""
    calibration = result.calibration
    count = len(result.used)
    camera = calibration.robot.camera_name or "without a name"
    lines = [
        f"{count} grasp{'' if count == 1 else 's'} of hand {calibration.hand}, camera {camera}",
        "",
        f"{'offset':<20}{'is':>10}{'sigma':>10}{'believed before':>18}",
        *_offsets(result),
        "",
    ]
    if calibration.unseen:
        lines += ["Not seen:", *(f"  {sentence}" for sentence in calibration.unseen), ""]
    lines += [
        f"{'grasp':<32}{'keyframes':>10}{'contact':>10}{'vision':>10}{'stands off':>12}{'NEES':>7}",
        *_grasps(result),
    ]
    if result.left_out:
        lines += ["", "Left out:"]
        lines += [f"  {name}: {reason}" for name, reason in result.left_out.items()]
    lines += ["", expectation(result)]
    return "\n".join(lines)


def expectation(result: Calibrated) -> str:
    """The error to expect from now on, in a sentence."""
    return (
        f"Expected error of the object's position while a pad touches: {1e3 * result.sigma_after:.1f} mm from now on, "
        f"{1e3 * result.sigma_before:.1f} mm before."
    )


def names_and_units(result: Calibrated) -> list[tuple[str, str, float]]:
    """Name, unit and size in that unit of one radian or metre, of each offset."""
    degree, millimetre = ("deg", math.degrees(1.0)), ("mm", 1e3)
    camera = [(name, *(degree if "turn" in name else millimetre)) for name in CAMERA]
    return camera + [(name, *degree) for name in result.calibration.joint_names]


def _offsets(result: Calibrated) -> Iterator[str]:
    sigmas = np.sqrt(np.diag(result.calibration.covariance))
    rows = zip(
        names_and_units(result), result.calibration.offsets, sigmas, result.before, strict=True
    )
    for (name, unit, scale), value, sigma, before in rows:
        numbers = f"{scale * value:+.2f}", f"{scale * sigma:.2f}", f"{scale * before:.2f} {unit}"
        yield f"{name:<20}{numbers[0]:>10}{numbers[1]:>10}{numbers[2]:>18}"


def _grasps(result: Calibrated) -> Iterator[str]:
    for used in result.used:
        left = used.residuals
        mm = [f"{1e3 * value:.2f} mm" for value in (left.contact, left.vision, left.stand_off)]
        yield (
            f"{used.name:<32}{used.keyframes:>10}{mm[0]:>10}{mm[1]:>10}{mm[2]:>12}{used.nees:>7.1f}"
        )
