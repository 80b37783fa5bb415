# SPDX-License-Identifier: MIT
"""What a benchmark asks of every solver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .clock import Time


@dataclass(frozen=True, eq=False)
class Solved:
    """One frame, or a batch of them, solved.

    Attributes:
        T_wo: Object poses, shape (B, 4, 4).
        time: How long the solver's call took, from poses and bits in its own types to a pose.
    """

    T_wo: np.ndarray
    time: Time


@dataclass(frozen=True, eq=False)
class Linearised:
    """The objective at one pose.

    Attributes:
        cost: 1/2 sum rho.
        information: J'WJ with the losses' weights, shape (6, 6), rotation first.
        gradient: -J'Wr, shape (6,).
    """

    cost: float
    information: np.ndarray
    gradient: np.ndarray


class Solver(Protocol):
    """A solver of one problem's frames."""

    name: str

    def solve(self, frame: int, T_start: np.ndarray, batch: int = 1) -> Solved:
        """Solve frames [frame, frame + batch), each from its start, T_start (batch, 4, 4)."""

    def linearise(self, frame: int, T_wo: np.ndarray) -> Linearised:
        """The frame's objective at T_wo (4, 4)."""

    def close(self) -> None:
        """Let go of what the solver holds."""
