# SPDX-License-Identifier: MIT
"""``python -m hardware run``: close the hand round an object and track it."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vtgtsam.commands.live_view import LOOPBACK, PORT, View, ViewHost, ViewPort, live_page
from vtgtsam.commands.options import Force, refuse_existing

from .options import (
    Camera,
    Emulate,
    Hand,
    Pads,
    Scale,
    Servos,
    Wrist,
    ask,
    calibration_file,
    needed_port,
)

if TYPE_CHECKING:
    import gtsam

    from hardware.live.devices import Devices
    from hardware.live.person import Ask
    from hardware.live.plan import Plan
    from hardware.servo.description import HandDescription
    from vtgtsam import EstimatorConfig

# A computer that emulates a hand beside driving it may pause either for longer than a real hand allows.
EMULATED = {"patience": 0.5, "watchdog": 2.5}  # [s]
EMULATED_GIVE_UP = 10.0  # [s], real: 1 s
CONFIGS = ("tuned", "simulation", "real_world")


def run(
    object: Annotated[str, typer.Option(help="The object: a built-in name, or its mesh.")],
    hand: Hand = "isyhand",
    emulate: Emulate = False,
    record: Annotated[Path | None, typer.Option(help="Record to this .mcap file.")] = None,
    seconds: Annotated[
        float | None,
        typer.Option(min=0.1, help="Duration; else until Ctrl-C, or the emulated grasp's end."),
    ] = None,
    servos: Servos = None,
    pads: Pads = None,
    camera: Camera = "realsense",
    scale: Scale = None,
    wrist: Wrist = None,
    start: Annotated[
        str | None,
        typer.Option(
            help="The object's first pose in the hand frame, x,y,z,qx,qy,qz,qw [m]; else the "
            "camera finds it."
        ),
    ] = None,
    object_scale: Annotated[float, typer.Option(help="Metres per unit of the mesh.")] = 1.0,
    tracker: Annotated[
        str, typer.Option(help="depth or depth-hand; with +back: told where the object is.")
    ] = "depth-hand",
    config: Annotated[str, typer.Option(help=f"{', '.join(CONFIGS)}, or a file.")] = "tuned",
    images: Annotated[bool, typer.Option(help="Record the images too.")] = True,
    view: View = False,
    view_host: ViewHost = LOOPBACK,
    view_port: ViewPort = PORT,
    save_view: Annotated[
        Path | None, typer.Option(help="Write what Rerun would show to this .rrd file.")
    ] = None,
    yes: Annotated[
        bool,
        typer.Option(
            "--yes",
            help="Ask nobody: begin at once, and wait until the camera sees the object lie still.",
        ),
    ] = False,
    calibration: Annotated[
        Path | None, typer.Option(help="The robot's calibration, of `vtgtsam calibrate`.")
    ] = None,
    calibrate: Annotated[
        bool, typer.Option("--calibrate", help="Calibrate camera and joints while it works.")
    ] = False,
    calibration_out: Annotated[
        Path | None,
        typer.Option(help="Calibrate while it works, and write what was found to this YAML file."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of the emulation's noise.")] = 0,
    force: Force = False,
) -> None:
    """Close the hand round an object, track it, and record everything."""
    from hardware.live.ages import GIVE_UP
    from hardware.live.devices import Ports, load_hand_and_grasp, real_devices
    from hardware.live.plan import Plan
    from hardware.servo.description import load_description
    from vtgtsam import Calibration, load_object
    from vtgtsam.vision.depth_tracker import FORMS
    from vtgtsam.vision.hand_back import BACK

    if tracker.removesuffix(BACK) not in FORMS:
        expected = f"{' or '.join(FORMS)}, or one of them with {BACK}"
        raise typer.BadParameter(f"expected {expected}", param_hint="--tracker")
    for file in (record, save_view, calibration_out):
        if file is not None:
            refuse_existing(file, force)
    where = live_page(view, view_host, view_port, save_view, typer.echo)
    description = load_description(hand)
    if emulate:
        description = description.model_copy(update=EMULATED)
    model, grasp = load_hand_and_grasp(description)
    settings = _config(config)
    calibrate = calibrate or calibration_out is not None
    if calibrate and not settings.memory:
        raise typer.BadParameter(
            f"calibrating needs settings with memory, those of {config!r} have none",
            param_hint="--calibrate",
        )
    plan = Plan(
        hand=model,
        grasp=grasp,
        obj=load_object(object, scale=object_scale),
        config=settings,
        T_ho=None if start is None else _start_pose(start),
        tracker=tracker,
        record=record,
        images=images,
        seconds=seconds,
        ends_after_grasp=emulate and seconds is None,
        give_up=EMULATED_GIVE_UP if emulate else GIVE_UP,
        view=where,
        calibration=None if calibration is None else Calibration.from_yaml(calibration),
        calibrate=calibrate,
        calibration_out=calibration_out,
    )
    if emulate:
        with _emulated(plan, description, seed) as devices:
            _carry_out(plan, devices, None)
        return
    ports = Ports(
        servos=needed_port(servos, "--servos"),
        pads=None if description.pads is None else needed_port(pads, "--pads"),
        camera=camera,
        scale=calibration_file(scale, hand, "pads"),
        wrist=calibration_file(wrist, hand, "wrist"),
    )
    _carry_out(plan, real_devices(ports, description, model), None if yes else ask)


def _carry_out(plan: Plan, devices: Devices, ask: Ask | None) -> None:
    from hardware.live.session import carry_out

    status = carry_out(plan, devices, ask, typer.echo)
    for line in status.summary():
        typer.echo(line)
    lost = 0.0 if devices.lost is None else devices.lost()
    if lost > 0:
        typer.echo(f"the computer was too slow: {lost:.1f} s were not simulated")
    if plan.record is not None:
        typer.echo(f"recorded to {plan.record}")
    if plan.view is not None and plan.view.save is not None:
        typer.echo(f"see it with: rerun {plan.view.save}")


@contextmanager
def _emulated(plan: Plan, description: HandDescription, seed: int) -> Iterator[Devices]:
    from hardware.emulate.rig import CAMERA_RATE
    from hardware.live.devices import emulated_devices

    # A new emulated servo has everything to set up; on a real one each change deserves a word.
    logging.getLogger("hardware.servo.setup").setLevel(logging.ERROR)
    typer.echo(f"emulated hand: looking for a pose in which it can grasp {plan.obj.name}")
    with emulated_devices(description, plan.hand, plan.obj, seed) as devices:
        typer.echo(
            f"emulated hand: depth images of a quarter of the D435's pixels at up to {CAMERA_RATE:.0f} Hz; waits up to "
            f"{1000 * EMULATED['patience']:.0f} ms for servos (real: 12 ms), watchdogs "
            f"{EMULATED['watchdog']:g} s (real: 0.2 s)"
        )
        yield devices


def _config(name_or_path: str) -> EstimatorConfig:
    from vtgtsam import EstimatorConfig

    if name_or_path in CONFIGS:
        config: EstimatorConfig = getattr(EstimatorConfig, name_or_path)()
        return config
    return EstimatorConfig.from_yaml(name_or_path)


def _start_pose(text: str) -> gtsam.Pose3:
    """T_ho from seven numbers."""
    import gtsam
    import numpy as np

    try:
        numbers = np.array([float(word) for word in text.split(",")])
    except ValueError:
        numbers = np.empty(0)
    if numbers.shape != (7,) or not abs(np.linalg.norm(numbers[3:]) - 1) < 1e-2:
        raise typer.BadParameter(
            f"expected the object's first pose in the hand frame, seven numbers x,y,z,qx,qy,qz,qw "
            f"with a quaternion of norm 1, got {text!r}",
            param_hint="--start",
        )
    qx, qy, qz, qw = numbers[3:] / np.linalg.norm(numbers[3:])
    return gtsam.Pose3(gtsam.Rot3.Quaternion(qw, qx, qy, qz), numbers[:3])
