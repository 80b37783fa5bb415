# SPDX-License-Identifier: MIT
"""``python -m hardware calibrate-wrist``: where the hand is, seen from the camera."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from vtgtsam.commands.options import Force, refuse_existing

from .options import Camera, Emulate, Hand, Servos, Wrist, calibration_file

if TYPE_CHECKING:
    import numpy as np

    from hardware.camera.camera import Camera as AnyCamera
    from hardware.camera.wrist import TagMount
    from hardware.servo.description import HandDescription
    from vtgtsam import HandModel


def calibrate_wrist(
    hand: Hand = "isyhand",
    camera: Camera = "realsense",
    servos: Servos = None,
    wrist: Wrist = None,
    emulate: Emulate = False,
    force: Force = False,
) -> None:
    """Find the hand in the camera frame from the AprilTag on its wrist, averaged over 30 images.

    With --servos the joints are read, torque off, and the depth image must show the hand where the tag puts it.
    """
    import numpy as np

    from hardware.camera.camera import open_camera
    from hardware.camera.hand_view import compare_with_depth
    from hardware.camera.wrist import measure_wrist, save_wrist
    from hardware.servo.description import load_description
    from vtgtsam.exceptions import ConfigError

    path = calibration_file(wrist, hand, "wrist")
    refuse_existing(path, force)
    description = load_description(hand)
    mount = description.wrist_tag
    if mount is None:
        raise ConfigError("the hand's file has no wrist_tag: say there which tag it is and where")
    model, joints = _model_and_joints(description, servos, emulate)
    with _emulated_camera(mount, model, joints) if emulate else open_camera(camera) as source:
        T_ch, tag, depth = measure_wrist(source, mount)
        intrinsics = source.intrinsics
    x, y, z = 1000 * T_ch.translation()
    angles = np.rad2deg(T_ch.rotation().rpy())
    typer.echo(
        f"hand at {x:.1f}, {y:.1f}, {z:.1f} mm in the camera frame, roll, pitch, yaw "
        f"{angles[0]:.1f}, {angles[1]:.1f}, {angles[2]:.1f} degrees"
    )
    typer.echo(f"from {tag.accepted} of {tag.images} images")
    if tag.warning:
        typer.echo(f"warning: {tag.warning}", err=True)
    if joints is None:
        typer.echo("not compared with the depth image: give --servos, so that the joints are known")
    else:
        typer.echo(compare_with_depth(T_ch, depth, intrinsics, model, joints, mount))
    save_wrist(path, T_ch)
    typer.echo(f"written to {path}")


def _model_and_joints(
    description: HandDescription, servos: str | None, emulate: bool
) -> tuple[HandModel, np.ndarray | None]:
    """The hand's model and its joint angles now; None where nobody knows them."""
    import numpy as np

    from hardware.live.devices import load_hand_and_grasp
    from hardware.servo.bus import Bus, BusError
    from hardware.servo.survey import let_go, survey

    model, _ = load_hand_and_grasp(description)
    if emulate:
        return model, np.zeros(len(model.joint_names))
    if servos is None:
        return model, None
    with Bus(servos, description.baud, {j.id: j.name for j in description.joints}) as bus:
        if silent := let_go(bus, description):
            raise BusError(f"no answer from {', '.join(silent)}: check their cables and ids")
        angles = {reading.joint.name: reading.angle for reading in survey(bus, description)}
    return model, model.joint_array(angles)


def _emulated_camera(mount: TagMount, hand: HandModel, joints: np.ndarray | None) -> AnyCamera:
    """A camera behind the hand that sees tag and hand from 0.45 m, as steeply as the paper's."""
    import gtsam
    import numpy as np

    from hardware.emulate.tag_view import HandCamera
    from sim.camera import D435

    down = np.arctan2(0.32, 0.31)  # [rad], from the horizontal
    R_ch = np.array(
        [
            [0.0, -1.0, 0.0],
            [-np.sin(down), 0.0, -np.cos(down)],
            [np.cos(down), 0.0, -np.sin(down)],
        ]
    )
    T_ch = gtsam.Pose3(gtsam.Rot3(R_ch), np.array([0.01, 0.02, 0.45]))
    assert joints is not None  # emulated ones are known
    return HandCamera(hand, joints, T_ch, mount, D435)
