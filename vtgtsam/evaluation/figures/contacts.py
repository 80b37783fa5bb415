# SPDX-License-Identifier: MIT
"""Which pads touch when: over all sequences, and in a single one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from ..contacts import Contacts, contact_shares
from ..groups import Group
from ..steps import STEP
from .drawing import Drawing
from .style import COLUMN

_TOUCHING = ListedColormap(["#f2f2f2", "#333333"])


def contacts_figure(group: Group, out: Path) -> Drawing | None:
    """How many sequences have which pad in contact at which time.

    None for a single sequence, which is shown frame by frame, and where contacts are not stored.
    """
    sequences = group.rows(group.tables.collected.turns)["sequence"]
    found = contact_shares(out, sequences) if len(sequences) > 1 else None
    if found is None:
        return None
    figure = Figure(figsize=(COLUMN, 1.2 + max(0.155 * len(found.pads), 1.8)))
    ax = figure.subplots()
    end = STEP * len(found.shares)
    image = ax.imshow(
        100 * found.shares.T,
        aspect="auto",
        interpolation="nearest",
        extent=(0, end, len(found.pads) - 0.5, -0.5),
        vmin=0,
        vmax=100,
        cmap="Blues",
    )
    _pad_axis(ax, found.pads)
    turns = group.rows(group.tables.collected.turns)[["turn_start", "turn_end"]].dropna()
    for time in turns.astype(float).median() if len(turns) else ():
        ax.axvline(time, color="black", lw=1.0, ls="--")
    ax.set_xlabel("time since the first frame [s]")
    figure.colorbar(image, ax=ax, label="sequences in contact [%]", fraction=0.05)
    words = f"Contacts of each pad over time, mean of {found.sequences} sequences."
    if len(turns):
        words += " Between the dashed lines the hand turns."
    if found.other_hands:
        words += f" {found.other_hands} sequences of a hand with other pads are left out."
    return Drawing(f"{group.slug}_contacts", words, _alt(found.pads, found.shares), figure)


def contact_raster(ax: Axes, contacts: Contacts) -> None:
    """One sequence's contacts: dark where a pad touches."""
    if len(contacts.times) < 2:
        edges = np.array([0.0, 1.0])
    else:
        middle = (contacts.times[1:] + contacts.times[:-1]) / 2
        edges = np.concatenate([contacts.times[:1], middle, contacts.times[-1:]])
    rows = np.arange(len(contacts.pads) + 1) - 0.5
    bits = contacts.bits[: len(edges) - 1].T
    ax.pcolormesh(edges, rows, bits, cmap=_TOUCHING, vmin=0, vmax=1, rasterized=True)
    ax.set_ylim(len(contacts.pads) - 0.5, -0.5)
    _pad_axis(ax, contacts.pads)


def _pad_axis(ax: Axes, pads: tuple[str, ...]) -> None:
    size = 7.5 if len(pads) <= 24 else 5.0
    names = [name.removeprefix("pad_").replace("_", " ") for name in pads]
    ax.set_yticks(range(len(pads)), names, fontsize=size)
    ax.tick_params(axis="y", length=0)
    ax.grid(False)


def _alt(pads: tuple[str, ...], shares: np.ndarray) -> str:
    mean = shares.mean(axis=0)
    order = np.argsort(-mean, kind="stable")[:3]
    most = ", ".join(f"{pads[k]} {100 * mean[k]:.0f} %" for k in order)
    return f"Heat map of contacts by pad and time. Most in contact: {most} of the time."
