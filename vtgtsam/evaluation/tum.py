# SPDX-License-Identifier: MIT
"""``tum/<method>/<sequence>.txt``: trajectories as evo and other tools read them.

Lines of "time x y z qx qy qz qw" [s, m], the object's pose in the world. Frames without a pose are left
out: the format cannot say so.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from .estimates import POSE


def tum_lines(rows: Iterable[Mapping[str, Any]]) -> list[str]:
    """Lines of one sequence, ``rows`` of its estimates by one method."""
    lines = ["# time x y z qx qy qz qw\n"]
    for row in rows:
        if row["x"] is not None:
            lines.append(
                " ".join([f"{row['time']:.9f}", *(repr(row[name]) for name in POSE)]) + "\n"
            )
    return lines
