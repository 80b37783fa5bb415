# SPDX-License-Identifier: MIT
"""What is wrong with a stream of measurements, in fixed words: people read them, programs compare them.

``docs/how-to/faults.md`` has a row for each: what it means, when it is seen, what to do.
"""

from __future__ import annotations

# Seen in one frame: what cannot be used is left out.
JOINTS_NOT_FINITE = "joints not finite"
HAND_POSE_NOT_FINITE = "hand pose not finite"
PADS_NOT_FINITE = "pad poses not finite"
VISION_NOT_FINITE = "vision not finite"
COVARIANCE_UNUSABLE = "vision's covariance unusable"
VISION_TOO_LATE = "vision too late"
TIME_WENT_BACK = "time went back"

# Seen over some frames.
VISION_REPEATS = "vision repeats itself"
VISION_JUMPS = "vision jumps"
VISION_FAR = "vision far from every pad that touches"
VISION_MILLIMETRES = "vision in millimetres"
JOINTS_OUT_OF_RANGE = "joints outside their range"
JOINTS_DEGREES = "joints in degrees"
HAND_FROZEN = "hand frozen while the object moves"
CONTACTS_INVERTED = "contacts inverted"
NO_FIT = "object does not fit"


def pad_disagrees(name: str) -> str:
    """A pad reports contact although it is far from the object."""
    return f"pad {name} disagrees with the rest"


def pad_flickers(name: str) -> str:
    """A pad's bit changes with nearly every frame."""
    return f"pad {name} flickers"
