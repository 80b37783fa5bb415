# SPDX-License-Identifier: MIT
"""When which pad touches, from the stored estimates; one sequence at a time is in memory."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import store
from .steps import STEP


@dataclass(frozen=True)
class Contacts:
    """One sequence's contact bits.

    Attributes:
        pads: Names of the pads.
        times: Of the frames [s], after the sequence's first, shape (N,).
        bits: Whether a pad touches, shape (N, K).
    """

    pads: tuple[str, ...]
    times: np.ndarray
    bits: np.ndarray


@dataclass(frozen=True)
class ContactShares:
    """How often each pad touches at which time.

    Attributes:
        pads: Names of the pads.
        shares: Mean over the sequences of the share of a step's frames in contact, shape (steps, K).
        sequences: Number of sequences.
        other_hands: Number of sequences left out, since their hand has other pads.
    """

    pads: tuple[str, ...]
    shares: np.ndarray
    sequences: int
    other_hands: int


def read_contacts(out: Path, sequence: str) -> Contacts | None:
    """One sequence's contacts, or None where they are not stored."""
    path = store.estimates_path(out, sequence)
    if not path.is_file():
        return None
    table, about = store.read_part(path, columns=["method", "time_rel", "contacts"])
    if "pads" not in about:
        return None
    method = table["method"].to_numpy(zero_copy_only=False)
    of_first = method == method[:1]  # all methods have the same contacts
    bits = np.array(table["contacts"].to_pylist(), dtype=bool).reshape(len(method), -1)
    return Contacts(tuple(about["pads"]), table["time_rel"].to_numpy()[of_first], bits[of_first])


def contact_shares(out: Path, sequences: Iterable[str]) -> ContactShares | None:
    """Contacts over time of all sequences whose hand is the first one's, or None where none is stored."""
    pads: tuple[str, ...] | None = None
    sums, counts = np.zeros((0, 0)), np.zeros(0)
    used = others = 0
    for sequence in sequences:
        contacts = read_contacts(out, sequence)
        if contacts is None:
            continue
        if pads is None:
            pads, sums = contacts.pads, np.zeros((0, len(contacts.pads)))
        if contacts.pads != pads:
            others += 1
            continue
        used += 1
        sums, counts = _added(sums, counts, _steps(contacts))
    if pads is None or not used:
        return None
    filled = counts >= 0.5 * used  # what few long sequences are left says little
    return ContactShares(pads, sums[filled] / counts[filled, None], used, others)


def _steps(contacts: Contacts) -> np.ndarray:
    """Share of the frames in contact, by step and pad; NaN in a step without a frame."""
    step = np.floor(contacts.times / STEP + 1e-9).astype(int)
    frames = np.bincount(step)
    sums = np.stack([np.bincount(step, weights=bits) for bits in contacts.bits.T], axis=1)
    with np.errstate(invalid="ignore"):
        return np.asarray(sums / frames[:, None])


def _added(
    sums: np.ndarray, counts: np.ndarray, shares: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Sums and counts with one more sequence, which may be longer."""
    longer = len(shares) - len(sums)
    if longer > 0:
        sums, counts = np.pad(sums, ((0, longer), (0, 0))), np.pad(counts, (0, longer))
    known = np.flatnonzero(~np.isnan(shares).any(axis=1))
    sums[known] += shares[known]
    counts[known] += 1
    return sums, counts
