# SPDX-License-Identifier: MIT
"""``python -m hardware pads | calibrate-pads``: what each pad says, and how it answers to 6 N."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from vtgtsam.commands.options import Force, refuse_existing

from .options import Emulate, Hand, Pads, Scale, ask, calibration_file, needed_port, show_live

if TYPE_CHECKING:
    from hardware.tactile.wiring import PadWiring


def pads(
    hand: Hand = "isyhand", pads: Pads = None, scale: Scale = None, emulate: Emulate = False
) -> None:
    """A live table of every pad: resistance, change since the start, pressure and contact. Press them.

    On a terminal until Ctrl-C, else once. Let nothing touch them in the first two seconds.
    """
    from hardware.servo.description import load_description, wiring_of

    wiring = wiring_of(load_description(hand))
    path = calibration_file(scale, hand, "pads")
    if not emulate:
        _watch(wiring, needed_port(pads, "--pads"), path)
        return
    from hardware.emulate.pads import PadPresser

    with PadPresser(wiring, typer.echo) as presser:
        _watch(wiring, presser.path, path)


def _watch(wiring: PadWiring, port: str, path: Path) -> None:
    import numpy as np

    from hardware.tactile.board import PadBoard
    from hardware.tactile.pressure import BASELINE_SECONDS, load_scale, pad_table

    scale = load_scale(path, wiring) if path.exists() else None
    if scale is None:
        typer.echo(f"there is no {path} yet, so no pressures: `python -m hardware calibrate-pads`")
    with PadBoard(port, inputs=len(wiring.inputs)) as board:
        board.wait()
        typer.echo(f"let nothing touch the pads for {BASELINE_SECONDS:.0f} s")
        first = np.nanmedian(wiring.resistance(board.record(BASELINE_SECONDS)), axis=0)

        def lines() -> list[str]:
            reading = board.latest()
            assert reading is not None  # one has come before
            age = time.monotonic() - reading.time
            table = pad_table(wiring, wiring.resistance(reading.values), first, scale)
            return [*table, board.counts().diagnosis() or f"newest reading {1000 * age:.0f} ms old"]

        show_live(lines)


def calibrate_pads(
    hand: Hand = "isyhand",
    pads: Pads = None,
    scale: Scale = None,
    emulate: Emulate = False,
    force: Force = False,
) -> None:
    """Walk through the calibration of the pads: untouched, then each pressed with 6 N."""
    from hardware.servo.description import load_description, wiring_of

    wiring = wiring_of(load_description(hand))
    path = calibration_file(scale, hand, "pads")
    refuse_existing(path, force)
    if not emulate:
        _walk_through(wiring, needed_port(pads, "--pads"), path, ask)
        return
    from hardware.emulate.pads import PadPresser

    with PadPresser(wiring, typer.echo) as presser:
        _walk_through(wiring, presser.path, path, presser.answer)


def _walk_through(wiring: PadWiring, port: str, path: Path, ask: Callable[[str], str]) -> None:
    from hardware.tactile.board import PadBoard
    from hardware.tactile.pressure import save_scale
    from hardware.tactile.wizard import PadWizard

    with PadBoard(port, inputs=len(wiring.inputs)) as board:
        board.wait()
        wizard = PadWizard(
            wiring=wiring,
            sample=lambda seconds: wiring.resistance(board.record(seconds)),
            ask=ask,
            say=typer.echo,
        )
        found = wizard.run()
    save_scale(path, found, wiring)
    typer.echo(f"written to {path}")
