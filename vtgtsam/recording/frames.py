# SPDX-License-Identifier: MIT
"""The instants at which all methods of a sequence are compared.

They are the instants of the visual poses. A tracker that has lost the object is silent, though, and frames
without a visual pose are the ones that matter most: while it is silent, from its first pose to the
recording's end, frames go on at its usual rate, with nothing from vision.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from ..measurement import Measurement
from .recording import Recording

SILENCE = 2.5  # [periods], a shorter gap is a late or dropped image, not a lost object


def evaluation_frames(recording: Recording) -> list[Measurement]:
    """A measurement at each visual pose, and without one while the tracker is silent."""
    seen = recording.measurements(rate="vision")
    if len(seen) < 2:
        return seen
    times = np.array([frame.time for frame in seen])
    period = float(np.median(np.diff(times)))
    # A grid over the whole recording, of which only the silences are used.
    grid = recording.measurements(rate=1.0 / period)
    silent = [
        dataclasses.replace(frame, T_wo_visual=None, visual_covariance=None)
        for frame in grid
        if _is_silent(frame.time, times, period, end=grid[-1].time)
    ]
    return sorted([*seen, *silent], key=lambda frame: frame.time)


def _is_silent(time: float, times: np.ndarray, period: float, end: float) -> bool:
    """Whether an instant lies in a gap of the visual poses' times, half a period from its ends."""
    after = int(np.searchsorted(times, time))
    if after == 0:
        return False
    start, stop = times[after - 1], times[after] if after < len(times) else end + period
    return bool(stop - start > SILENCE * period and start + period / 2 < time < stop - period / 2)
