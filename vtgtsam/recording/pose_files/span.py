# SPDX-License-Identifier: MIT
"""Whether stamps from a file are of a recording's time at all, and in seconds."""

from __future__ import annotations

import numpy as np

from ...exceptions import RecordingError
from .files import PoseFiles

OUTSIDE_NS = 10**9  # [ns], poses that far before or after a recording are of another one
UNITS = {1e-9: "nanoseconds", 1e-6: "microseconds", 1e-3: "milliseconds"}


def inside(times_ns: np.ndarray, start_ns: int, end_ns: int) -> np.ndarray:
    """Which instants (N,) [ns] are of a recording's time."""
    return (times_ns >= max(start_ns - OUTSIDE_NS, 0)) & (times_ns <= end_ns + OUTSIDE_NS)


def check_span(files: PoseFiles, times_ns: np.ndarray, start_ns: int, end_ns: int) -> None:
    """Refuse poses most of which are of another time, or share their stamps.

    Raises:
        RecordingError: It says what the stamps look like.
    """
    within = inside(times_ns, start_ns, end_ns)
    if 2 * np.count_nonzero(within) < len(times_ns):
        raise RecordingError(
            f"{len(times_ns) - np.count_nonzero(within)} of the {len(times_ns)} poses in {files.path} lie "
            f"outside the recording's time: they are from {times_ns.min() / 1e9:.2f} to "
            f"{times_ns.max() / 1e9:.2f} s, the recording from {start_ns / 1e9:.2f} to "
            f"{end_ns / 1e9:.2f} s; {_why(times_ns, start_ns, end_ns)}"
        )
    different = len(np.unique(times_ns))
    if 2 * different < len(times_ns):
        raise RecordingError(
            f"the {len(times_ns)} poses in {files.path} have only {different} different stamps; are they "
            "rounded to whole seconds? Write them with their decimals (%.6f)"
        )


def _why(times_ns: np.ndarray, start_ns: int, end_ns: int) -> str:
    for scale, name in UNITS.items():
        scaled = np.rint(times_ns * scale).astype(np.int64)
        lasts = np.ptp(scaled) > 0.1 * (end_ns - start_ns)
        if lasts and np.mean(inside(scaled, start_ns, end_ns)) > 0.5:
            return f"are the stamps {name}? Give --time-scale {scale:g}"
    return "are the stamps of one clock, and --latency in seconds?"
