# SPDX-License-Identifier: MIT
"""Pressures from the raw values of resistive pads while they come, by the rule of ``recording.pad_calibration``."""

from __future__ import annotations

import numpy as np

from ..exceptions import RecordingError
from ..recording.pad_calibration import untouched_base
from ..recording.topics import ContactsTopic

MOST = 20_000  # messages that a baseline is learnt from, ten seconds at 2 kHz


class Baseline:
    """Learns what untouched pads say from the first messages, and tells pressures from then on.

    Args:
        entry: The topic, with a calibration and the pads' names.
    """

    def __init__(self, entry: ContactsTopic) -> None:
        assert entry.calibration is not None and entry.names is not None
        self._entry, self._count = entry, len(entry.names)
        self._untouched_ns = round(entry.calibration.untouched * 1e9)
        self._drop = np.asarray(entry.calibration.drop)
        self._first: list[np.ndarray] = []
        self._start_ns: int | None = None
        self._base: np.ndarray | None = None

    def pressures(self, stamp_ns: int, values: np.ndarray, threshold: float) -> np.ndarray | None:
        """Pressures as fractions of 6 N, shape (K,); None while the baseline is being learnt.

        Raises:
            ValueError: The numbers of values, names and drops differ, or pads were touched; it begins again.
        """
        if self._drop.shape not in ((), values.shape) or len(values) != self._count:
            raise ValueError(
                f"has {len(values)} values, the map {self._count} names and {self._drop.size} drops for them"
            )
        if self._base is None:
            self._learn(stamp_ns, values, threshold)
        return None if self._base is None else np.maximum((self._base - values) / self._drop, 0.0)

    def _learn(self, stamp_ns: int, values: np.ndarray, threshold: float) -> None:
        if self._start_ns is None:
            self._start_ns = stamp_ns
        if stamp_ns - self._start_ns <= self._untouched_ns and len(self._first) < MOST:
            self._first.append(values)
            return
        first, self._first, self._start_ns = np.array(self._first), [], None
        try:
            self._base = untouched_base(first, self._entry, threshold)
        except RecordingError as error:
            raise ValueError(str(error)) from None
