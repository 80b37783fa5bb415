# SPDX-License-Identifier: MIT
"""The devices of a run, real or emulated: from here on nothing knows which.

A hand of other motors or with other pads enters here: give functions that open a ``HandDevice`` and a
``PadDevice`` (``hardware.device``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import gtsam

from hardware.camera.camera import Camera, open_camera
from hardware.camera.wrist import load_wrist
from hardware.device import HandDevice, PadDevice
from hardware.servo.description import HandDescription, misfits
from hardware.servo.hand import Hand
from hardware.tactile.pressure import BoardPads, PadScale, load_scale
from vtgtsam.exceptions import ConfigError
from vtgtsam.grasp import GraspDescription, load_grasp

from .sensors import NoPads

if TYPE_CHECKING:
    from vtgtsam import HandModel, ObjectModel

Truth = Callable[[float, gtsam.Pose3], None]


@dataclass(frozen=True, eq=False)
class Devices:
    """How the devices are opened, what was calibrated before, and how the object gets into the hand.

    Attributes:
        open_hand: Opens the hand.
        open_pads: Opens its pads.
        open_camera: Opens the camera; given what to tell true poses T_co to, if they are known.
        T_ch: The hand's pose in the camera frame.
        put_object: Puts the object on the palm and returns when it lies there; None where a person does it.
        lost: Time an emulator could not simulate [s]; None for real devices.
    """

    open_hand: Callable[[], HandDevice]
    open_pads: Callable[[], PadDevice]
    open_camera: Callable[[Truth], Camera]
    T_ch: gtsam.Pose3
    put_object: Callable[[], None] | None = None
    lost: Callable[[], float] | None = None


@dataclass(frozen=True)
class Ports:
    """What a person says of the real devices.

    Attributes:
        servos: The servos' port.
        pads: The pad board's port; None for a hand without pads.
        camera: As for ``open_camera``.
        scale: File of the pads' bench calibration.
        wrist: File of the hand's pose in the camera frame.
    """

    servos: str
    pads: str | None
    camera: str
    scale: Path
    wrist: Path


def real_devices(ports: Ports, description: HandDescription, hand: HandModel) -> Devices:
    """The devices on these ports; nothing is opened yet.

    Args:
        ports: Where they are.
        description: The built hand.
        hand: Its model, in whose order of pads contacts are wanted.

    Raises:
        ConfigError: A calibration is missing or wrong.
    """
    scale = None
    if description.pads is not None:
        scale = load_scale(ports.scale, description.pads)
    return Devices(
        open_hand=lambda: Hand(description, ports.servos),
        open_pads=_pads(ports.pads, description, scale, hand),
        open_camera=lambda truth: open_camera(ports.camera),
        T_ch=load_wrist(ports.wrist),
    )


@contextmanager
def emulated_devices(
    description: HandDescription, hand: HandModel, obj: ObjectModel, seed: int
) -> Iterator[Devices]:
    """Devices that one simulated grasp drives, in a process of their own.

    Raises:
        VtgtsamError: The object cannot be grasped.
    """
    from hardware.emulate.rig_process import RigProcess  # MuJoCo and the simulator, only here

    with RigProcess(description, obj, seed) as rig:
        yield Devices(
            open_hand=lambda: Hand(description, rig.ready.servos),
            open_pads=_pads(rig.ready.pads, description, rig.ready.scale, hand),
            open_camera=rig.camera,
            T_ch=gtsam.Pose3(rig.ready.T_ch),
            put_object=rig.put_object,
            lost=rig.lost,
        )


def _pads(
    port: str | None, description: HandDescription, scale: PadScale | None, hand: HandModel
) -> Callable[[], PadDevice]:
    wiring = description.pads
    if wiring is None or scale is None or port is None:
        return lambda: NoPads(len(hand))
    return lambda: BoardPads(port, wiring, scale, hand.pad_names)


def load_hand_and_grasp(description: HandDescription) -> tuple[HandModel, GraspDescription]:
    """The model of a built hand and how it closes, all of whose joints and pads are there by name.

    Raises:
        ConfigError: The hand's file and its model name different joints or pads; all are listed.
        HandError: Model or grasp cannot be read, or name different joints.
    """
    if not description.grasp and Path(description.hand).is_file():
        raise ConfigError(
            f"the hand's file names the model {description.hand} but not how it closes: say so under `grasp`, "
            "with a file like vtgtsam/grasp/isyhand.yaml"
        )
    grasp = load_grasp(description.grasp or description.hand)
    hand = grasp.load_hand()
    grasp.check(hand)
    if found := misfits(description, hand):
        raise ConfigError(f"the hand's file does not fit hand {hand.name!r}: {'; '.join(found)}")
    without = sorted(set(grasp.ranks()) - set(description.joint_names))
    if without:
        raise ConfigError(f"the grasp closes joints without a servo: {', '.join(without)}")
    return hand, grasp
