# SPDX-License-Identifier: MIT
"""When a sequence's faults were named: a row each on the time line."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes

COLOR = "#a50f15"


def fault_rows(ax: Axes, faults: Mapping[str, np.ndarray]) -> None:
    """Ticks at the instants [s] of each fault, the fault's words at the left."""
    for row, instants in enumerate(faults.values()):
        ax.plot(instants, np.full(len(instants), row), "|", ms=6, color=COLOR)
    ax.set_ylim(len(faults) - 0.5, -0.5)
    ax.set_yticks(range(len(faults)), list(faults), fontsize=7.5)
    ax.tick_params(axis="y", length=0)
    ax.grid(False)
