# SPDX-License-Identifier: MIT
"""``python -m hardware calibrate-wrist``: where the hand is, seen from the camera."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

from .options import Camera, Emulate, Hand, Wrist, calibration_file

if TYPE_CHECKING:
    from hardware.camera.camera import Camera as AnyCamera
    from hardware.camera.wrist import TagMount


def calibrate_wrist(
    hand: Hand = "isyhand",
    camera: Camera = "realsense",
    wrist: Wrist = None,
    emulate: Emulate = False,
) -> None:
    """Find the hand in the camera frame from the AprilTag on its wrist, averaged over 30 images."""
    import numpy as np

    from hardware.camera.camera import open_camera
    from hardware.camera.wrist import measure_wrist, save_wrist
    from hardware.servo.description import load_description
    from vtgtsam.exceptions import ConfigError

    mount = load_description(hand).wrist_tag
    if mount is None:
        raise ConfigError("the hand's file has no wrist_tag: say there which tag it is and where")
    with _emulated_camera(mount) if emulate else open_camera(camera) as source:
        T_ch, tag = measure_wrist(source, mount)
    x, y, z = 1000 * T_ch.translation()
    angles = np.rad2deg(T_ch.rotation().rpy())
    typer.echo(
        f"hand at {x:.1f}, {y:.1f}, {z:.1f} mm in the camera frame, roll, pitch, yaw "
        f"{angles[0]:.1f}, {angles[1]:.1f}, {angles[2]:.1f} degrees"
    )
    typer.echo(f"from {tag.accepted} of {tag.images} images")
    if tag.warning:
        typer.echo(f"warning: {tag.warning}", err=True)
    path = calibration_file(wrist, hand, "wrist")
    save_wrist(path, T_ch)
    typer.echo(f"written to {path}")


def _emulated_camera(mount: TagMount) -> AnyCamera:
    """A camera that sees a tag at 0.45 m, tilted by 40 degrees."""
    import gtsam
    import numpy as np

    from hardware.emulate.tag_view import TagCamera
    from sim.camera import D435

    T_ct = gtsam.Pose3(gtsam.Rot3.RzRyRx(np.deg2rad(40), 0.1, 0.0), np.array([0.02, 0.0, 0.45]))
    return TagCamera(T_ct, mount.size, D435)
