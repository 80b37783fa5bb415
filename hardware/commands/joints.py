# SPDX-License-Identifier: MIT
"""``python -m hardware joints | calibrate-joints | off | reboot``: the servos, one by one, torque off."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vtgtsam.commands.options import Force, refuse_existing

from .options import Emulate, Hand, Servos, ask, needed_port, show_live

if TYPE_CHECKING:
    from hardware.servo.bus import Bus
    from hardware.servo.description import HandDescription, Joint

Joints = Annotated[
    list[str] | None, typer.Option("--joint", help="A joint's name; may be given more than once.")
]


def joints(hand: Hand = "isyhand", servos: Servos = None, emulate: Emulate = False) -> None:
    """Torque off, then a live table of every joint: count, angle, limits, heat, supply. Move them by hand.

    On a terminal until Ctrl-C, else once.
    """
    from hardware.servo.survey import first_of, survey, table

    with _line(hand, servos, emulate) as (bus, description):
        _let_go(bus, description)
        first = survey(bus, description)

        def lines() -> list[str]:
            nonlocal first
            now = survey(bus, description)
            first = first_of(first, now)
            return table(now, first)

        show_live(lines)


def off(hand: Hand = "isyhand", servos: Servos = None, emulate: Emulate = False) -> None:
    """Take the torque off every servo and see that it is off, as after a program that was killed."""
    with _line(hand, servos, emulate) as (bus, description):
        _let_go(bus, description)


def reboot(
    hand: Hand = "isyhand",
    servos: Servos = None,
    joint: Joints = None,
    emulate: Emulate = False,
) -> None:
    """Restart servos after a hardware error: those named, or all that report one."""
    from hardware.servo.survey import restart

    with _line(hand, servos, emulate) as (bus, description):
        _let_go(bus, description)
        for line in restart(bus, description, joint or ()) or ["no servo reports a hardware error"]:
            typer.echo(line)


def calibrate_joints(
    hand: Hand = "isyhand",
    servos: Servos = None,
    joint: Joints = None,
    out: Annotated[
        Path | None,
        typer.Option(help="File to write; the hand's own, or HAND.yaml here for a built-in hand."),
    ] = None,
    calibration: Annotated[
        Path | None,
        typer.Option(
            "--from",
            help="Take zeros from this file of `vtgtsam calibrate`; no servos are needed, signs stay.",
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Measure zeros and signs: hold each joint at two marks and say its angle. Writes the hand's file.

    Or move the zeros by what recorded grasps say of them (--from).
    """
    from hardware.servo.description import DATA, description_path, load_description
    from hardware.servo.survey import JointWizard, save_zeros

    source = description_path(hand)
    path = out or (Path(source.name) if source.parent == DATA else source)
    if path != source:
        refuse_existing(path, force)
    if calibration is not None:
        found = _calibrated(load_description(hand), calibration, joint)
        save_zeros(source, path, found)
        typer.echo(
            f"{len(found)} joints written to {path}; use it with --hand {path}. The calibration file is now for "
            "older recordings only: new ones read these zeros"
        )
        return
    with _line(hand, servos, emulate=False) as (bus, description):
        _let_go(bus, description)
        chosen = [j for j in description.joints if joint is None or j.name in joint]
        if joint and len(chosen) < len(joint):
            known = ", ".join(description.joint_names)
            raise typer.BadParameter(f"the joints are {known}", param_hint="--joint")
        wizard = JointWizard(
            joints=chosen,
            count=lambda j: bus.read(j.id, "present_position"),
            ask=ask,
            say=typer.echo,
            positive=_positive(description),
        )
        found = wizard.run()
    if found:
        save_zeros(source, path, found)
        typer.echo(f"{len(found)} joints written to {path}; use it with --hand {path}")


def _calibrated(
    description: HandDescription, path: Path, names: list[str] | None
) -> dict[str, Joint]:
    """The hand's joints with the zeros that a calibration has measured; says each with its uncertainty."""
    import numpy as np

    from hardware.servo.survey import moved_zeros
    from vtgtsam import Calibration

    measured = Calibration.from_yaml(path)
    sigmas = np.sqrt(np.diag(measured.covariance)[6:])
    chosen = {n: dq for n, dq in measured.joint_zeros.items() if not names or n in names}
    if missing := sorted(set(names or ()) - set(chosen)):
        raise typer.BadParameter(f"{path} has no joints {', '.join(missing)}", param_hint="--joint")
    found = moved_zeros(description.joints, chosen)
    was = {joint.name: joint.zero for joint in description.joints}
    for name, sigma in zip(measured.joint_names, sigmas, strict=True):
        if name in found:
            typer.echo(
                f"{name}: zero {was[name]} -> {found[name].zero}, as it reads {np.rad2deg(chosen[name]):+.2f} degrees "
                f"too much (within {np.rad2deg(2 * sigma):.2f})"
            )
    return found


def _positive(description: HandDescription) -> dict[str, str]:
    """What a positive angle of a joint does, where the hand's grasp says so."""
    from vtgtsam.exceptions import HandError
    from vtgtsam.grasp import load_grasp

    try:
        grasp = load_grasp(description.grasp or description.hand)
    except HandError:
        return {}
    return {
        name: "closes the hand" if grasp.sign(name) > 0 else "opens the hand"
        for name in grasp.ranks()
    }


def _let_go(bus: Bus, description: HandDescription) -> None:
    from hardware.servo.survey import let_go

    silent = let_go(bus, description)
    count = len(description.joints) - len(silent)
    typer.echo(f"torque is off at {count} of {len(description.joints)} servos")
    if silent:
        typer.echo(f"no answer from {', '.join(silent)}: `python -m hardware check` looks for them")


@contextmanager
def _line(hand: str, servos: str | None, emulate: bool) -> Iterator[tuple[Bus, HandDescription]]:
    """The hand's servo line, whoever is on it."""
    from hardware.servo.bus import Bus
    from hardware.servo.description import load_description

    description = load_description(hand)
    names = {joint.id: joint.name for joint in description.joints}
    if not emulate:
        with Bus(needed_port(servos, "--servos"), description.baud, names) as bus:
            yield bus, description
        return
    from hardware.emulate.servos import ServoLineEmulator

    with (
        ServoLineEmulator(names, description.baud, model=description.servo) as line,
        Bus(line.path, description.baud, names) as bus,
    ):
        yield bus, description
