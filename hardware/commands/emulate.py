# SPDX-License-Identifier: MIT
"""``python -m hardware emulate``: an emulated hand for any client."""

from __future__ import annotations

import json
import signal
from typing import Annotated

import typer

from .options import Hand


def emulate(
    hand: Hand = "isyhand",
    object: Annotated[
        str | None, typer.Option(help="An object to lie on the palm from the start.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the pads' noise.")] = 0,
) -> None:
    """Serve an emulated hand on pseudo terminals until Ctrl-C.

    The first line is JSON: {"servos": "<port>", "pads": "<port>"}.
    """
    from hardware.emulate.rig import Rig
    from hardware.servo.description import load_description
    from vtgtsam import load_object

    with Rig(load_description(hand), load_object(object or "can"), seed) as rig:
        if object is not None:
            rig.hand.put(rig.prepare())
        ports = {"servos": rig.servos.path, "pads": rig.pads.path}
        print(json.dumps(ports), flush=True)
        signal.pause()  # a signal ends it by an exception
