# SPDX-License-Identifier: MIT
"""A hand that nobody prepared: other frames, other signs, a slide, a mimic joint; by its files alone."""

import numpy as np
import pytest
import trimesh

from sim import constants as c
from sim.hands import load_description
from sim.placement import above_palm
from sim.simulate import simulate
from sim.world import World
from vtgtsam import ObjectModel, build_sdf

# A gripper in a URDF without its meshes: the palm faces +x and the fingers point along -z. The finger
# closes by a negative angle and its tip follows it; the thumb stands on the other side.
LINK = """
  <link name="{name}">
    <inertial>
      <origin xyz="{center}"/><mass value="0.03"/>
      <inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/>
    </inertial>
    <visual><geometry><mesh filename="package://gone/{name}.stl"/></geometry></visual>
    <collision><origin xyz="{center}"/><geometry><box size="{size}"/></geometry></collision>
    <collision name="skin_{name}">
      <origin xyz="{skin}" rpy="{rpy}"/><geometry><box size="{skin_size} 0.003"/></geometry>
    </collision>
  </link>"""
JOINT = """
  <joint name="{name}_joint" type="revolute">
    <parent link="{parent}"/><child link="{name}"/><origin xyz="{xyz}"/><axis xyz="0 1 0"/>
    <limit lower="{lower}" upper="{upper}" effort="1" velocity="3"/>{mimic}
  </joint>"""
ALONG_X = "0 1.570796 0"  # turns a pad's +z to the link's +x
LINKS = [
    ("palm", "0 0 0", "0.02 0.10 0.16", "0.0095 0 0", ALONG_X, "0.15 0.09"),
    ("finger", "0 0 -0.03", "0.016 0.06 0.056", "0.0075 0 -0.03", ALONG_X, "0.05 0.05"),
    ("tip", "0 0 -0.02", "0.014 0.06 0.04", "0.0065 0 -0.02", ALONG_X, "0.036 0.05"),
    ("thumb", "0.04 0 0", "0.06 0.06 0.01", "0.04 0 -0.0045", "3.141593 0 0", "0.05 0.05"),
]
JOINTS = [
    ("finger", "palm", "0 0 -0.09", -1.5, 0.2, ""),
    ("tip", "finger", "0 0 -0.06", -1.5, 0.2, '<mimic joint="finger_joint" multiplier="0.8"/>'),
    ("thumb", "palm", "0 0 0.07", -0.2, 1.5, ""),
]
URDF = (
    '<robot name="gripper">'
    + "".join(
        LINK.format(name=name, center=center, size=size, skin=skin, rpy=rpy, skin_size=skin_size)
        for name, center, size, skin, rpy, skin_size in LINKS
    )
    + "".join(
        JOINT.format(name=name, parent=parent, xyz=xyz, lower=lower, upper=upper, mimic=mimic)
        for name, parent, xyz, lower, upper, mimic in JOINTS
    )
    + "</robot>"
)
YAML = """
hand: gripper.urdf
pads: "skin_*"
fingers: [[finger_joint]]
thumb: [thumb_joint]
opens: [finger_joint]
palm: {center: [0.011, 0, -0.02], normal: [1, 0, 0], fingers: [0, 0, -1]}
"""


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    folder = tmp_path_factory.mktemp("gripper")
    (folder / "gripper.urdf").write_text(URDF)
    (folder / "gripper.yaml").write_text(YAML)
    description = load_description(folder / "gripper.yaml")
    mesh = trimesh.creation.box((0.12, 0.04, 0.06))
    obj = ObjectModel("box", build_sdf(mesh, 32), mesh, mass=0.1)
    return World(description, description.load_hand(), obj)


def test_its_pads_are_found_and_the_mimic_joint_has_no_servo(world):
    assert world.hand.pad_names == ("skin_palm", "skin_finger", "skin_tip", "skin_thumb")
    assert world.hand.coupled_joints == ("tip_joint",)
    assert world.model.nu == 3  # finger, thumb, wrist
    assert world.on_fingers.tolist() == [False, True, True, True]


def test_it_is_held_palm_up_with_its_fingers_towards_the_camera(world):
    world.place(np.eye(4))
    T_wp = world.hand.pad_transforms(world.joints(), world.T_wh())
    np.testing.assert_allclose(T_wp[0, :3, 2], (0, 0, 1), atol=1e-5)
    assert T_wp[1, 0, 3] > 0.1


def test_it_grasps_a_box_and_holds_it_through_the_turn(world):
    T_wo = above_palm(world.description, world.obj.mesh, np.eye(3))
    trajectory = simulate(world, T_wo)
    # Pressed by the tip against palm and thumb, whose pad does not reach up to the box's edge.
    assert trajectory.contacts[-1].tolist() == [True, False, True, False]
    np.testing.assert_allclose(
        trajectory.T_wh[-1, :3, :3] @ (0, 0, -1), (np.sqrt(0.5), 0, np.sqrt(0.5)), atol=2e-3
    )
    finger, tip = trajectory.joints[-1, :2]
    assert finger < -0.2
    assert tip == pytest.approx(0.8 * finger, abs=0.05)  # the coupling yields a little under load
    assert np.quantile(trajectory.overlap[trajectory.contacts], 0.95) < 0.0003
    held = trajectory.time >= c.TURN_START
    T_ho = np.linalg.solve(trajectory.T_wh, trajectory.T_wo)
    assert np.ptp(T_ho[held, :3, 3], axis=0).max() < c.MAX_SLIP


def test_bodies_without_names_will_do(tmp_path):
    (tmp_path / "flat.xml").write_text("""
        <mujoco>
          <worldbody>
            <site name="pad_base" type="box" size="0.05 0.05 0.001"/>
            <body>
              <body pos="0.1 0 0">
                <joint name="bend" axis="0 -1 0" range="0 90"/>
                <geom type="capsule" fromto="0 0 0 0.05 0 0" size="0.01"/>
                <site name="pad_tip" type="box" pos="0.03 0 0.01" size="0.01 0.01 0.001"/>
              </body>
            </body>
          </worldbody>
        </mujoco>""")
    (tmp_path / "flat.yaml").write_text("""
        hand: flat.xml
        fingers: [[bend]]
        palm: {center: [0, 0, 0], normal: [0, 0, 1], fingers: [1, 0, 0]}""")
    description = load_description(tmp_path / "flat.yaml")
    mesh = trimesh.creation.box((0.04, 0.04, 0.04))
    obj = ObjectModel("box", build_sdf(mesh, 16), mesh)
    world = World(description, description.load_hand(), obj)
    world.place(above_palm(description, mesh, np.eye(3)))
    for _ in range(500):
        world.step()
    world.refresh()
    assert (world.touch()[0] > 0).tolist() == [True, False]
    assert world.on_fingers.tolist() == [False, True]
