# SPDX-License-Identifier: MIT
"""Options that several commands share."""

from __future__ import annotations

import os
import select
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import typer

from vtgtsam.exceptions import VtgtsamError

_GLANCE = 0.1  # [s], how often is watched while a person is asked

Hand = Annotated[str, typer.Option(help="The built hand: a name, or its YAML file.")]
Emulate = Annotated[bool, typer.Option("--emulate", help="Use emulated devices.")]
Servos = Annotated[
    str | None,
    typer.Option(help="Serial port of the servos, as /dev/serial/by-id/... or /dev/ttyUSB0."),
]
Pads = Annotated[
    str | None,
    typer.Option(help="Serial port of the pad board, as /dev/serial/by-id/... or /dev/ttyACM0."),
]
Camera = Annotated[str, typer.Option(help="realsense, realsense:SERIAL, or a recording.")]
Scale = Annotated[
    Path | None, typer.Option(help="Pad calibration; HAND.pads.yaml where not given.")
]
Wrist = Annotated[
    Path | None, typer.Option(help="Wrist calibration; HAND.wrist.yaml where not given.")
]


def calibration_file(given: Path | None, hand: str, kind: str) -> Path:
    """Where a hand's calibration of that kind ("pads" or "wrist") is kept."""
    return given or Path(f"{Path(hand).stem}.{kind}.yaml")


def needed_port(port: str | None, option: str) -> str:
    """The port a person gave.

    Raises:
        typer.BadParameter: None was given; lists those there are.
    """
    if port is None:
        raise typer.BadParameter(
            f"give the port, or --emulate; there are: {', '.join(serial_ports()) or 'none'}",
            param_hint=option,
        )
    return port


def serial_ports() -> list[str]:
    """Serial ports of this computer, by their lasting names where they have one."""
    from serial.tools import list_ports

    by_id = Path("/dev/serial/by-id")
    lasting = {str(link.resolve()): str(link) for link in by_id.glob("*")}
    found = (port.device for port in list_ports.comports() if port.vid is not None)
    return sorted(lasting.get(device, device) for device in found)


def ask(question: str, watch: Callable[[], None] = lambda: None) -> str:
    """What a person types, without the end of the line; ``watch`` is called all the while.

    Raises:
        VtgtsamError: Nobody is there.
    """
    print(question, end="", flush=True)
    typed = b""
    while not typed.endswith(b"\n"):
        watch()
        if select.select([0], [], [], _GLANCE)[0]:
            # One byte at a time: what follows the line is the answer to the next question.
            byte = os.read(0, 1)
            if not byte:
                raise VtgtsamError("nobody is there to press Enter; `run` asks nobody with --yes")
            typed += byte
    return typed.decode(errors="replace").strip()


def show_live(lines: Callable[[], list[str]], period: float = 0.2) -> None:
    """Show a table that changes until Ctrl-C on a terminal, where it is written over; else once."""
    if not sys.stdout.isatty():
        print("\n".join(lines()), flush=True)
        return
    height = 0
    while True:
        text = lines()
        up = f"\x1b[{height}A" if height else ""
        print(up + "".join(f"\x1b[2K{line}\n" for line in text), end="", flush=True)
        height = len(text)
        time.sleep(period)
