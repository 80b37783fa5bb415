# SPDX-License-Identifier: MIT
"""Short recordings of a box between four pads, for the tests of the evaluation.

The box is 40 x 60 x 80 mm. Its visual pose is off by a few millimetres; the pads touch it where they are.
"""

from pathlib import Path

import gtsam
import numpy as np
import trimesh

from vtgtsam.recording import RecordingWriter

HALF = np.array([0.02, 0.03, 0.04])  # [m]

_SIDES = {"pad_xp": (1, 0), "pad_xn": (-1, 0), "pad_yp": (0, 1), "pad_yn": (0, -1)}
PADS = tuple(_SIDES)


def _site(name: str) -> str:
    x, y = _SIDES[name]
    place = f"{x * HALF[0]} {y * HALF[1]} 0"
    return (
        f'<body pos="{place}"><joint name="j_{name}" axis="1 0 0"/><geom size="0.001"/>'
        f'<site name="{name}" type="box" size="0.01 0.012 0.0001" zaxis="{-x} {-y} 0"/></body>'
    )


HAND_XML = f'<mujoco model="clamp"><worldbody>{"".join(map(_site, _SIDES))}</worldbody></mujoco>'


def box_obj() -> bytes:
    mesh = trimesh.creation.box(extents=2 * HALF).subdivide()
    return trimesh.exchange.obj.export_obj(mesh, include_normals=False).encode()


def turned(share: float) -> gtsam.Pose3:
    """The hand after this share of its turn by 45 degrees."""
    return gtsam.Pose3(gtsam.Rot3.Ry(share * np.pi / 4), np.array([0.1, 0.2, 0.3]))


def write_grasp(
    path: Path,
    seed: int = 0,
    frames: int = 20,
    truth: bool = True,
    camera: bool = True,
    turn: bool = True,
    silent: tuple[int, int] = (0, 0),
    **metadata: str,
) -> Path:
    """A recording whose hand turns in its second third, at 1/0.033 Hz.

    Args:
        path: The file.
        seed: Of the visual pose's error.
        frames: Number of frames.
        truth: Whether the true pose is recorded.
        camera: Whether the camera's pose is.
        turn: Whether the hand turns.
        silent: First frame without and first frame again with a visual pose.
        metadata: Entries of the metadata record; object, dataset and so on.
    """
    rng = np.random.default_rng(seed)
    offset = gtsam.Pose3.Expmap(np.concatenate([rng.normal(0, 0.05, 3), rng.normal(0, 4e-3, 3)]))
    path.parent.mkdir(parents=True, exist_ok=True)
    info = {"object": "box", "hand": "clamp", "dataset": "vary", "tracker": "depth"} | metadata
    with RecordingWriter(path, info, hand_xml=HAND_XML, mesh=box_obj()) as writer:
        if camera:
            writer.camera_pose(1.0, gtsam.Pose3(gtsam.Rot3.Rx(np.pi), np.array([0.0, 0.0, 1.0])))
        for k in range(frames):
            t = 1.0 + 0.033 * k
            T_wh = turned(np.clip(3 * k / frames - 1, 0, 1) if turn else 0.0)
            writer.joint_states(t, [f"j_{name}" for name in PADS], np.zeros(4))
            writer.tactile(t, PADS, np.full(4, 0.5), np.ones(4))
            writer.hand_pose(t, T_wh)
            if truth:
                writer.truth(t, T_wh)
            if not silent[0] <= k < silent[1]:
                jitter = gtsam.Pose3.Expmap(rng.normal(0, 5e-4, 6))
                writer.object_pose(t, T_wh * offset * jitter)
    return path
