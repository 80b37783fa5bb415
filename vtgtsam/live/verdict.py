# SPDX-License-Identifier: MIT
"""What to tell people of an estimate: its status, and what is wrong with the measurements."""

from __future__ import annotations

from ..estimate import Estimate


def in_words(estimate: Estimate) -> str:
    """The status, and the faults behind a colon: "ok", "contradicted: vision jumps"."""
    return (
        f"{estimate.status}: {', '.join(estimate.faults)}" if estimate.faults else estimate.status
    )
