# SPDX-License-Identifier: MIT
"""YAML that a command takes: configuration, topic map, calibration."""

from __future__ import annotations

from pathlib import Path

import gtsam
import numpy as np
from held_box import PADS, box_obj, write_grasp

from vtgtsam.calibration.calibration import Calibration
from vtgtsam.calibration.robot import Robot
from vtgtsam.config import EstimatorConfig
from vtgtsam.recording.topics import load_topics

from .kind import Kind, command, library

TOPICS = """hand: isyhand
pads: "pad_*"
object: {mesh: box.obj, scale: 1.0, origin: [0, 0, 0.01]}
topics:
  joints: /joint_states
  contacts: {topic: /tactile/contacts, names: [pad_xp, pad_xn, pad_yp, pad_yn], threshold: 0.15}
  hand_pose: /hand/pose
  vision: {topic: /vision/object_pose, latency: 0.06, frame: camera}
  camera_pose: [0.6, 0, 0.576, 0, 0, 0, 1]
  truth: /truth/object_pose
"""
CONFIG = """method: vis+tac+pen
iterations: 5
w_vis: {rotation: 100.0, translation: 1.0e+4}
w_pen: 1.0e+6
log_theta_vis: 5.0
recover: true
"""


def _yamls(folder: Path) -> list[bytes]:
    write_grasp(folder / "whole.mcap", frames=3)
    (folder / "box.obj").write_bytes(box_obj())
    return [CONFIG.encode(), TOPICS.encode(), _calibration().text().encode()]


def _calibration() -> Calibration:
    joints = {f"j_{name}": 0.01 for name in PADS}
    robot = Robot("clamp", tuple(joints), "infrared", gtsam.Pose3())
    covariance = np.diag([1e-4] * 3 + [1e-6] * 3 + [1e-4] * 4)
    return Calibration(robot, np.full(6, 1e-3), np.zeros(3), joints, covariance, ("nothing",))


def _use_yaml(path: Path, folder: Path, rng: np.random.Generator) -> str:
    whole = folder / "whole.mcap"
    if path.name == "topics.yaml":
        return library(lambda: load_topics(path)) or command("inspect", whole, "--topics", path)
    reads, option = {
        "config.yaml": (EstimatorConfig.from_yaml, "--config"),
        "calibration.yaml": (Calibration.from_yaml, "--calibration"),
    }[path.name]
    out = ("--out", folder / "out", "--methods", "vis")
    return library(lambda: reads(path)) or command("evaluate", whole, *out, option, path)


YAML = Kind(("config.yaml", "topics.yaml", "calibration.yaml"), _yamls, _use_yaml)
