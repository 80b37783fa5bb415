# SPDX-License-Identifier: MIT
"""Hands as MJCF, as URDF, and as pads on another file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from held_box import HAND_XML, write_grasp

from vtgtsam import load_hand

from .kind import Kind, command, library

URDF = """<robot name="clamp"><link name="palm"><collision name="pad_a"><origin xyz="0 0 0.01"/><geometry>
<box size="0.02 0.02 0.004"/></geometry></collision></link><link name="tip"><inertial><mass value="0.1"/><inertia
ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="j" type="revolute">
<parent link="palm"/><child link="tip"/><axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>
</joint></robot>"""
PAD_FILE = """hand: hand.xml
pads:
  - {name: pad_a, body: b, pos: [0, 0, 0.01], size: [0.02, 0.02], normal: [0, 0, 1]}
  - {name: pad_b, geom: g, face: +z, size: [0.01, 0.01]}
"""
BODY = """<mujoco model="h"><default><geom rgba="1 0 0 1"/></default><asset><texture name="t" type="2d" builtin="flat"
width="8" height="8"/><mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset><worldbody><body name="b"><joint
name="j" range="-1 1"/><geom name="g" type="box" size="0.02 0.02 0.02"/><replicate count="3" offset="0.1 0 0">
<geom size="0.01"/></replicate></body></worldbody></mujoco>"""


def _hands(folder: Path) -> list[bytes]:
    write_grasp(folder / "whole.mcap", frames=3)
    return [HAND_XML.encode(), BODY.encode(), URDF.encode(), PAD_FILE.encode()]


def _use_hand(path: Path, folder: Path, rng: np.random.Generator) -> str:
    (folder / ("hand.xml" if path.suffix == ".yaml" else "unused.xml")).write_text(BODY)

    def use() -> None:
        hand = load_hand(path)
        T = hand.pad_transforms(dict.fromkeys(hand.joint_names, 0.0))
        assert np.isfinite(T).all(), "pads are nowhere"

    return library(use) or command("inspect", folder / "whole.mcap", "--hand", path)


HAND = Kind(("box.xml", "body.xml", "clamp.urdf", "pads.yaml"), _hands, _use_hand)
