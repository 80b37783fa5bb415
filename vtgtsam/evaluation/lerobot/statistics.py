# SPDX-License-Identifier: MIT
"""Smallest, largest, mean and standard deviation of a column, as LeRobot keeps them to normalise by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass
class Statistics:
    """Of the finite values of a column, number by number; all 0 where there are none.

    Attributes:
        frames: How many there were.
        count: How many of each number's values were finite, shape (D,).
        low: Their smallest.
        high: Their largest.
        total: Their sum.
        squares: The sum of their squares.
    """

    frames: int
    count: np.ndarray
    low: np.ndarray
    high: np.ndarray
    total: np.ndarray
    squares: np.ndarray

    @classmethod
    def of(cls, values: np.ndarray) -> Statistics:
        """Of a column of N frames, shape (N,) or (N, D)."""
        values = np.asarray(values, dtype=np.float64).reshape(len(values), -1)
        finite = np.isfinite(values)
        known = np.where(finite, values, 0.0)
        return cls(
            frames=len(values),
            count=finite.sum(axis=0),
            low=np.where(finite, values, np.inf).min(axis=0),
            high=np.where(finite, values, -np.inf).max(axis=0),
            total=known.sum(axis=0),
            squares=(known**2).sum(axis=0),
        )

    def __add__(self, other: Statistics) -> Statistics:
        return Statistics(
            frames=self.frames + other.frames,
            count=self.count + other.count,
            low=np.minimum(self.low, other.low),
            high=np.maximum(self.high, other.high),
            total=self.total + other.total,
            squares=self.squares + other.squares,
        )

    def as_lerobot(self) -> dict[str, list[float] | list[int]]:
        """Under LeRobot's names."""
        there = np.maximum(self.count, 1)
        mean = self.total / there
        variance = np.maximum(self.squares / there - mean**2, 0.0)
        return {
            "min": np.where(self.count > 0, self.low, 0.0).tolist(),
            "max": np.where(self.count > 0, self.high, 0.0).tolist(),
            "mean": mean.tolist(),
            "std": np.sqrt(variance).tolist(),
            "count": [self.frames],
        }
