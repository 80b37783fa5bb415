# SPDX-License-Identifier: MIT
"""What a check finds, as a value."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

What = Literal[
    "clocks differ",
    "clock steps back",
    "clocks drift apart",
    "two publishers of one name",
    "frames differ",
    "joint beyond its range",
    "vision off the truth",
    "vision turned from the truth",
    "vision flips",
    "truth repeats itself",
    "hand far from the object",
    "pad touches nothing",
    "pad looks past what it touches",
]
Level = Literal["problem", "warning"]


@dataclass(frozen=True)
class Finding:
    """One thing that does not fit.

    Attributes:
        what: It in fixed words, the same in every command and live.
        sentence: It with names and numbers, and what to do.
        level: "problem" where results would be wrong; "warning" where it may be right but seldom is.
        about: The topic, joint or pad that it is about.
    """

    what: What
    sentence: str
    level: Level
    about: str = ""
