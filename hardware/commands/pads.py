# SPDX-License-Identifier: MIT
"""``python -m hardware calibrate-pads``: how each pad answers to 6 N."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from .options import Emulate, Hand, Pads, Scale, calibration_file, needed_port

if TYPE_CHECKING:
    from hardware.tactile.wiring import PadWiring


def calibrate_pads(
    hand: Hand = "isyhand", pads: Pads = None, scale: Scale = None, emulate: Emulate = False
) -> None:
    """Walk through the calibration of the pads: untouched, then each pressed with 6 N."""
    from hardware.servo.description import load_description, wiring_of

    wiring = wiring_of(load_description(hand))
    path = calibration_file(scale, hand, "pads")
    if not emulate:
        _walk_through(wiring, needed_port(pads, "--pads"), path, input)
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
