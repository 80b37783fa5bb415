# SPDX-License-Identifier: MIT
"""Recordings of one robot that grips boxes, and believes something wrong about its camera and its joints.

Four fingers hinge below the object and close until their pads touch; the palm touches from below. The hand then turns
by 45 degrees. Distances are the mesh's own, so contacts are as true as a grid of points allows.
"""

from pathlib import Path
from typing import NamedTuple

import gtsam
import numpy as np
import trimesh

from vtgtsam import HandModel
from vtgtsam.recording import RecordingWriter
from vtgtsam.recording.camera_share import camera_share

LEVER, REACH = (
    0.06,
    0.032,
)  # [m], from a finger's joint to its pad, and from the middle to the joints
HALF_Z = 0.03  # [m], of all boxes
_SIDES = {"xp": (1, 0), "xn": (-1, 0), "yp": (0, 1), "yn": (0, -1)}
JOINTS = tuple(f"j_{name}" for name in _SIDES)
PADS = (*(f"pad_{name}" for name in _SIDES), "pad_palm")
CAMERA = gtsam.Pose3(gtsam.Rot3.Rx(np.pi), np.array([0.0, 0.0, 1.0]))


def _finger(name: str) -> str:
    x, y = _SIDES[name]
    return (
        f'<body pos="{x * REACH} {y * REACH} {-LEVER}"><joint name="j_{name}" axis="{y} {-x} 0"/>'
        f'<geom size="0.001"/><site name="pad_{name}" type="box" pos="0 0 {LEVER}" '
        f'size="0.01 0.012 0.0001" zaxis="{-x} {-y} 0"/></body>'
    )


HAND_XML = (
    f'<mujoco model="gripper"><worldbody>{"".join(map(_finger, _SIDES))}<body pos="0 0 {-HALF_Z}">'
    '<geom size="0.001"/><site name="pad_palm" type="box" size="0.015 0.015 0.0001" zaxis="0 0 1"/></body>'
    "</worldbody></mujoco>"
)


class Offsets(NamedTuple):
    """What a robot believes wrongly: its camera's twist about the world's origin, (6,), and joint zeros [rad], (4,)."""

    camera: np.ndarray
    zeros: np.ndarray

    @property
    def T_error(self) -> gtsam.Pose3:
        return gtsam.Pose3.Expmap(self.camera)


NONE = Offsets(np.zeros(6), np.zeros(4))


def drawn(seed: int) -> Offsets:
    """Offsets as large as the recommended settings expect them to be."""
    rng = np.random.default_rng(seed)
    camera = np.concatenate([rng.normal(0, 0.01, 3), rng.normal(0, 0.0012, 3)])
    return Offsets(camera, rng.normal(0, np.deg2rad(1.0), 4))


def closed(half: np.ndarray) -> np.ndarray:
    """Joint angles [rad], shape (4,), at which the pads touch a box with half these sides, amid the hand."""
    hand = HandModel.from_text(HAND_XML)
    low, high = np.zeros(4), np.full(4, 0.6)
    for _ in range(40):
        middle = (low + high) / 2
        points, offsets = hand.pad_points(middle)
        outside = np.abs(points) - half
        distances = np.linalg.norm(np.maximum(outside, 0), axis=1)
        distances += np.minimum(outside.max(axis=1), 0)
        least = np.minimum.reduceat(distances, offsets[:-1])[:4]
        low, high = np.where(least > 0, middle, low), np.where(least > 0, high, middle)
    return low


def write_grip(
    path: Path,
    robot: Offsets = NONE,
    seed: int = 0,
    frames: int = 75,
    idle: tuple[str, ...] = (),
    mesh_scale: float = 1.0,
    lost: bool = False,
    camera: gtsam.Pose3 = CAMERA,
    hand_xml: str = HAND_XML,
    device: str = "",
    old_covariances: bool = False,
    started: str = "",
    correlation: float = 0.0,
) -> Path:
    """A recording at 30 Hz.

    Args:
        path: The file.
        robot: What the robot believes wrongly.
        seed: Of the box and of the tracker's noise.
        frames: Number of frames.
        idle: Pads that report no contact; their fingers are open.
        mesh_scale: Size of the attached mesh, of the box's.
        lost: Whether the tracker leaves the object after half a second.
        camera: Where the camera is, if it were believed rightly.
        hand_xml: The attached hand.
        device: The camera's name.
        old_covariances: Whether the visual poses' hold the camera's error too, as they once did.
        correlation: How long the tracker says that its errors stay alike [s].
        started: When the live run began that made it; empty: none made it.
    """
    rng = np.random.default_rng(seed)
    half = np.array([*rng.uniform(0.018, 0.028, 2), HALF_Z - 1e-4])
    touches = np.array([name not in idle for name in PADS])
    angles = np.where(touches[:4], closed(half), -0.3) + robot.zeros
    mesh = trimesh.creation.box(extents=2 * mesh_scale * half).subdivide()
    obj = trimesh.exchange.obj.export_obj(mesh, include_normals=False).encode()
    path.parent.mkdir(parents=True, exist_ok=True)
    info = {
        "object": "box",
        "hand": "gripper",
        "dataset": "vary",
        "tracker": "depth",
        "camera": device,
        "calibration_error": "yes",
    }
    if started:
        info["started"] = started
    if not old_covariances:
        info["visual_covariance"] = "tracker"
    with RecordingWriter(path, info, hand_xml=hand_xml, mesh=obj) as writer:
        writer.camera_pose(1.0, robot.T_error * camera)
        for k in range(frames):
            t, share = 1.0 + k / 30, np.clip(3 * k / frames - 1, 0, 1)
            T_wh = gtsam.Pose3(gtsam.Rot3.Ry(share * np.pi / 4), np.zeros(3))
            writer.joint_states(t, JOINTS, angles)
            writer.tactile(t, PADS, 0.5 * touches, touches)
            writer.hand_pose(t, T_wh)
            writer.truth(t, T_wh)
            noise = np.concatenate([rng.normal(0, 4e-3, 3), rng.normal(0, 4e-4, 3)])
            away = gtsam.Pose3(gtsam.Rot3(), np.array([0.0, 0.08, 0.0]) * (lost and k > 15))
            seen = robot.T_error * T_wh * away * gtsam.Pose3.Expmap(noise)
            share = camera_share(seen) if old_covariances else 0.0
            if correlation > 0.0:
                writer.vision_correlation(t, correlation)
            writer.object_pose(t, seen, np.diag([4e-3] * 3 + [4e-4] * 3) ** 2 + share)
    return path
