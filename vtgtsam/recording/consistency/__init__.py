# SPDX-License-Identifier: MIT
"""Streams held against each other: what does not fit, the same for every command and for a running robot.

One check a file. Each takes the evidence and yields findings; it is silent where it lacks what it needs.
"""

from __future__ import annotations

from .clocks import check_clock_steps, check_clocks
from .evidence import Evidence as Evidence
from .finding import Finding as Finding
from .frames import check_frames
from .held import check_held
from .publishers import check_publishers
from .ranges import check_ranges
from .repeats import check_repeats
from .rotation import check_rotation
from .vision import check_vision

CHECKS = (
    check_clock_steps,
    check_clocks,
    check_publishers,
    check_frames,
    check_ranges,
    check_repeats,
    check_vision,
    check_rotation,
    check_held,
)


def check(evidence: Evidence) -> list[Finding]:
    """All that does not fit, in a fixed order."""
    return [finding for one in CHECKS for finding in one(evidence)]
