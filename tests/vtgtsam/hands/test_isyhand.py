# SPDX-License-Identifier: MIT
"""The built-in hand against kinematics built independently from the published joint table."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vtgtsam import load_hand

# Joint, parent, origin xyz [m], origin rpy [rad], axis, as in the URDF of version 6 of the hand
# (github.com/benrichardson28/isyhand_ros2, MIT), and the name of our joint, None where version 2
# has none.
FLEXION = (0, -1, 0)
OPPOSITION = (-0.25882, -0.96593, 0)
TABLE = [
    ("J14", None, (0.0965, 0.011, 0.0365), (-1.5708, 0, -1.5708), FLEXION, None),
    ("J13", "J14", (0.0146, 0.0085, 0.031), (-3.1416, 0, -1.5708), FLEXION, "index_proximal"),
    ("J12", "J13", (3.9445e-5, 0, -0.039938), (0, 0, 0), FLEXION, "index_middle"),
    ("J11", "J12", (3.9445e-5, 0, -0.039938), (0, 0, 0), FLEXION, "index_distal"),
    ("J51", None, (0.072, 0.0323, 0.0277), (1.5708, 1.5708, 3.14159265), FLEXION, "palm_inner"),
    ("J34", "J51", (-0.00865, -0.0245, 0.0257), (1.5708, 1.5708, 0), FLEXION, None),
    ("J33", "J34", (0.0146, 0.0085, 0.031), (3.1416, 0, -1.5708), FLEXION, "middle_proximal"),
    ("J32", "J33", (3.9445e-5, 0, -0.039938), (0, 0, 0), FLEXION, "middle_middle"),
    ("J31", "J32", (3.9445e-5, 0, -0.039938), (0, 0, 0), FLEXION, "middle_distal"),
    ("J52", "J51", (0.00015, 0, 0.047), (0, 0, 0), FLEXION, "palm_outer"),
    ("J44", "J52", (-0.00865, -0.0245, 0.0257), (1.5708, 1.5708, 0), FLEXION, None),
    ("J43", "J44", (0.0146, 0.0085, 0.031), (-3.1416, 0, -1.5708), FLEXION, "ring_proximal"),
    ("J42", "J43", (3.9445e-5, 0, -0.039938), (0, 0, 0), FLEXION, "ring_middle"),
    ("J41", "J42", (3.9445e-5, 0, -0.039938), (0, 0, 0), FLEXION, "ring_distal"),
    ("J24", None, (0.039895, 0.024634, 0.0495), (0, 0, 1.8326), FLEXION, "thumb_rotation"),
    ("J23", "J24", (0.0146, 0.0085, 0.033), (3.1416, 0, -1.8326), OPPOSITION, "thumb_proximal"),
    ("J22", "J23", (3.8101e-5, -1.0209e-5, -0.039938), (0, 0, 0), OPPOSITION, "thumb_middle"),
    ("J21", "J22", (3.8101e-5, -1.0209e-5, -0.039938), (0, 0, 0), OPPOSITION, "thumb_distal"),
]
# The model rounds positions to 0.01 mm and the thumb's direction to 15 degrees.
ATOL = 5e-5  # [m], five joints of 0.01 mm each


@pytest.fixture(scope="module")
def hand():
    return load_hand("isyhand")


def link_poses(angles):
    """Pose of each link in the base frame for joint angles by our names, from the table alone."""
    poses = {None: np.eye(4)}
    for joint, parent, xyz, rpy, axis, name in TABLE:
        T = np.eye(4)
        T[:3, :3] = Rotation.from_euler("xyz", rpy).as_matrix()
        T[:3, 3] = xyz
        turn = np.eye(4)
        angle = angles.get(name, 0.0)
        unit = np.array(axis) / np.linalg.norm(axis)
        turn[:3, :3] = Rotation.from_rotvec(angle * unit).as_matrix()
        poses[joint] = poses[parent] @ T @ turn
    return {name: poses[joint] for joint, *_, name in TABLE if name}


def link_of(pad_name):
    return pad_name.removeprefix("pad_").removesuffix("_1").removesuffix("_2")


def random_angles(hand, rng):
    return dict(zip(hand.joint_names, rng.uniform(*hand.model.jnt_range.T), strict=True))


def test_the_hand_has_15_joints_and_16_pads(hand):
    assert sorted(hand.joint_names) == sorted(row[-1] for row in TABLE if row[-1])
    assert len(hand.pad_names) == 16
    links = [link_of(name) for name in hand.pad_names]
    assert sorted(set(links)) == sorted(set(hand.joint_names) - {"thumb_rotation"})
    assert sorted(link for link in links if links.count(link) == 2) == [
        "palm_inner", "palm_inner", "palm_outer", "palm_outer",
    ]  # fmt: skip


@pytest.mark.parametrize("seed", range(5))
def test_pads_move_with_their_links_as_the_joint_table_says(hand, seed):
    angles = random_angles(hand, np.random.default_rng(seed))
    at_zero = link_poses({})
    moved = link_poses(angles)
    T_hp_zero = hand.pad_transforms(dict.fromkeys(hand.joint_names, 0.0))
    T_hp = hand.pad_transforms(angles)
    for name, T_zero, T in zip(hand.pad_names, T_hp_zero, T_hp, strict=True):
        motion = moved[link_of(name)] @ np.linalg.inv(at_zero[link_of(name)])
        np.testing.assert_allclose(T, motion @ T_zero, atol=ATOL, err_msg=name)


def test_pads_lie_on_their_links_and_face_the_palm_side(hand):
    T_hp = dict(zip(hand.pad_names, hand.pad_transforms(np.zeros(15)), strict=True))
    origins = {name: pose[:3, 3] for name, pose in link_poses({}).items()}
    for name, T in T_hp.items():
        towards = (0, 0, 1) if "thumb" not in name else (0.965926, 0.258819, 0)
        np.testing.assert_allclose(T[:3, 2], towards, atol=1e-6, err_msg=name)
    for finger, y in (("index", 0.011), ("middle", 0.058), ("ring", 0.105)):
        for link in ("proximal", "middle", "distal"):
            pad = T_hp[f"pad_{finger}_{link}"][:3, 3]
            joint = origins[f"{finger}_{link}"]
            np.testing.assert_allclose(pad - joint, (0.020, y - joint[1], 0.0105), atol=ATOL)


def test_the_joint_ranges_are_the_published_ones(hand):
    ranges = dict(zip(hand.joint_names, hand.model.jnt_range, strict=True))
    for name, (lower, upper) in ranges.items():
        expected = (-0.2, 1.57)
        expected = (-0.44, 0.44) if "palm" in name else expected
        expected = (-1.13, 1.13) if name == "thumb_rotation" else expected
        assert (lower, upper) == expected, name


def test_the_mass_is_the_published_total(hand):
    assert hand.model.body_mass.sum() == pytest.approx(0.6414, abs=1e-4)


def test_the_file_compiles_and_steps_without_warnings(hand):
    data = mujoco.MjData(hand.model)
    rng = np.random.default_rng(0)
    for _ in range(500):
        data.qfrc_applied[:] = rng.uniform(-0.05, 0.05, hand.model.nv)
        mujoco.mj_step(hand.model, data)
    assert sum(warning.number for warning in data.warning) == 0


@pytest.mark.parametrize("bend", [0.0, 0.4, 0.8])
def test_fingers_that_bend_evenly_do_not_touch_each_other(hand, bend):
    data = mujoco.MjData(hand.model)
    for name in hand.joint_names:
        data.joint(name).qpos = bend if name.startswith(("index", "middle", "ring")) else 0.0
    mujoco.mj_forward(hand.model, data)
    assert data.ncon == 0
