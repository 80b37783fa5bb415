# SPDX-License-Identifier: MIT
"""Files of a hand on the bench: its servos, its pads' scale, its pose before the camera."""

from __future__ import annotations

from pathlib import Path

import gtsam
import numpy as np

from hardware.camera.wrist import load_wrist, save_wrist
from hardware.live.health import check_model
from hardware.servo.description import description_path, load_description, wiring_of
from hardware.tactile.pressure import PadScale, load_scale, save_scale

from .kind import Kind, library


def _files(folder: Path) -> list[bytes]:
    wiring = wiring_of(load_description("isyhand"))
    count = len(wiring.inputs)
    save_scale(folder / "scale.yaml", PadScale(np.full(count, 1e5), np.full(count, 2e4)), wiring)
    save_wrist(folder / "wrist.yaml", gtsam.Pose3(gtsam.Rot3.Rx(1.0), [0.1, 0.2, 0.6]))
    servos = description_path("isyhand").read_bytes()
    return [servos, *((folder / name).read_bytes() for name in ("scale.yaml", "wrist.yaml"))]


def _use(path: Path, folder: Path, rng: np.random.Generator) -> str:
    if path.name == "servos.yaml":
        return library(lambda: check_model(load_description(path)))
    if path.name == "scale.yaml":
        return library(lambda: load_scale(path, wiring_of(load_description("isyhand"))))
    return library(lambda: load_wrist(path))


BENCH = Kind(("servos.yaml", "scale.yaml", "wrist.yaml"), _files, _use)
