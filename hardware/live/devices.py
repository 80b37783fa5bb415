# SPDX-License-Identifier: MIT
"""The devices of a run, real or emulated: from here on nothing knows which."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import gtsam

from hardware.camera.camera import Camera, open_camera
from hardware.camera.wrist import load_wrist
from hardware.emulate.rig_process import RigProcess
from hardware.servo.description import HandDescription
from hardware.tactile.pressure import PadScale, load_scale
from vtgtsam import ObjectModel

Truth = Callable[[float, gtsam.Pose3], None]
Ask = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Devices:
    """Where the devices are, what was calibrated before, and how the object gets into the hand.

    Attributes:
        servos: The servos' port.
        pads: The pad board's port.
        scale: The pads' bench calibration.
        T_ch: The hand's pose in the camera frame.
        open_camera: Opens the camera; given what to tell true poses T_co to, if they are known.
        put_object: Has the object put on the palm; returns when it lies there.
        lost: Time an emulator could not simulate [s]; None for real devices.
    """

    servos: str
    pads: str
    scale: PadScale
    T_ch: gtsam.Pose3
    open_camera: Callable[[Truth], Camera]
    put_object: Callable[[], None]
    lost: Callable[[], float] | None = None


@dataclass(frozen=True)
class Ports:
    """What a person says of the real devices.

    Attributes:
        servos: The servos' port.
        pads: The pad board's port.
        camera: As for ``open_camera``.
        scale: File of the pads' bench calibration.
        wrist: File of the hand's pose in the camera frame.
    """

    servos: str
    pads: str
    camera: str
    scale: Path
    wrist: Path


def real_devices(ports: Ports, description: HandDescription, ask: Ask) -> Devices:
    """The devices on these ports.

    Raises:
        ConfigError: A calibration is missing or wrong.
    """
    if description.pads is None:
        raise ValueError("a live run needs a hand with pads")
    return Devices(
        servos=ports.servos,
        pads=ports.pads,
        scale=load_scale(ports.scale, description.pads),
        T_ch=load_wrist(ports.wrist),
        open_camera=lambda truth: open_camera(ports.camera),
        put_object=lambda: ask(
            "Put the object on the palm, take your hands away, then press Enter: "
        ),
    )


@contextmanager
def emulated_devices(
    description: HandDescription, obj: ObjectModel, seed: int
) -> Iterator[Devices]:
    """Devices that one simulated grasp drives, in a process of their own.

    Raises:
        VtgtsamError: The object cannot be grasped.
    """
    with RigProcess(description, obj, seed) as rig:
        yield Devices(
            servos=rig.ready.servos,
            pads=rig.ready.pads,
            scale=rig.ready.scale,
            T_ch=gtsam.Pose3(rig.ready.T_ch),
            open_camera=rig.camera,
            put_object=rig.put_object,
            lost=rig.lost,
        )
