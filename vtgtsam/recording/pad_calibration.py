# SPDX-License-Identifier: MIT
r"""Pressures from the raw values of resistive pads, as the paper has them (tactile sensor hardware).

A press lowers a pad's resistance R, so that drops below the untouched baseline count, in units of the
drop under a force of 6 N:

    u = max((R_base - R) / (R_base - R_6N), 0)

The baseline wanders from run to run: it is the median of the bag's first seconds, untouched.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..exceptions import RecordingError
from .topics import ContactsTopic

_TOUCHED = 0.1  # share of readings above the threshold with which a pad was not untouched

Raw = tuple[int, np.ndarray]  # stamp [ns], values of all pads (K,)


def pressures(raw: Sequence[Raw], entry: ContactsTopic, threshold: float) -> list[Raw]:
    """Pressures as fractions of 6 N in the place of raw values.

    Args:
        raw: Stamps [ns] and values, in any order.
        entry: The topic, with a calibration and the pads' names.
        threshold: Pressure from which on a pad is in contact.

    Raises:
        RecordingError: The numbers of values, names and drops differ, or a pad was touched while
            nothing was to touch it.
    """
    assert entry.calibration is not None and entry.names is not None
    if not raw:
        return []
    drop = np.asarray(entry.calibration.drop)
    sizes = {len(entry.names), *(len(values) for _, values in raw), *drop.shape}
    if len(sizes) > 1:
        raise RecordingError(
            f"topic {entry.topic} has {len(raw[0][1])} values, the map {len(entry.names)} names and "
            f"{drop.size} drops for them; give as many names as values, and one drop or one for each"
        )
    start = min(stamp for stamp, _ in raw)
    first = [v for stamp, v in raw if stamp - start <= entry.calibration.untouched * 1e9]
    base = untouched_base(np.array(first), entry, threshold)
    return [(stamp, np.maximum((base - values) / drop, 0.0)) for stamp, values in raw]


def untouched_base(first: np.ndarray, entry: ContactsTopic, threshold: float) -> np.ndarray:
    """Each pad's value while nothing touches it, shape (K,).

    Args:
        first: Values of the untouched pads, shape (T, K).
        entry: The topic, with a calibration and the pads' names.
        threshold: Pressure from which on a pad is in contact.

    Raises:
        RecordingError: A pad was touched.
    """
    assert entry.calibration is not None
    base: np.ndarray = np.median(first, axis=0)
    _check_untouched((base - first) / np.asarray(entry.calibration.drop), entry, threshold)
    return base


def _check_untouched(first: np.ndarray, entry: ContactsTopic, threshold: float) -> None:
    """Refuse a baseline from values (T, K) that move by more than a contact does."""
    assert entry.calibration is not None and entry.names is not None
    moving = np.mean(np.abs(first) >= threshold, axis=0) > _TOUCHED
    if moving.any():
        names = ", ".join(name for name, bad in zip(entry.names, moving, strict=True) if bad)
        raise RecordingError(
            f"topic {entry.topic}: {names} changed in the first {entry.calibration.untouched:g} s, in "
            "which nothing should have touched the hand; shorten 'untouched' in the map, or give the "
            "raw value of a contact as threshold, without calibration"
        )
