# SPDX-License-Identifier: MIT
"""``python -m hardware check``: what is there, what is wrong, how to mend it."""

from __future__ import annotations

import typer

from .options import (
    Camera,
    Emulate,
    Hand,
    Pads,
    Scale,
    Servos,
    Wrist,
    calibration_file,
    serial_ports,
)


def check(
    hand: Hand = "isyhand",
    servos: Servos = None,
    pads: Pads = None,
    camera: Camera = "realsense",
    scale: Scale = None,
    wrist: Wrist = None,
    emulate: Emulate = False,
) -> None:
    """Look at files, servos, pads and camera as a run needs them, moving nothing; exit code 1 unless all is well."""
    from hardware.live import health
    from hardware.servo.description import load_description

    description = load_description(hand)
    if emulate:
        from hardware.emulate.rig import Rig
        from vtgtsam import load_object

        with Rig(description, load_object("can")) as rig:
            findings = [
                health.check_model(description),
                health.check_servos(description, rig.servos.path),
                health.check_pads(description, rig.pads.path),
            ]
    else:
        findings = [
            health.check_model(description),
            health.check_calibrations(
                description,
                calibration_file(scale, hand, "pads"),
                calibration_file(wrist, hand, "wrist"),
            ),
            health.check_ports(serial_ports()),
            health.check_servos(description, servos),
            health.check_pads(description, pads),
            health.check_camera(camera),
        ]
    for finding in findings:
        for line in finding.lines():
            typer.echo(line)
    if not all(finding.ok for finding in findings):
        raise typer.Exit(1)
