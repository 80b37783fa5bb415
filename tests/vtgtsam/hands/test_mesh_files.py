# SPDX-License-Identifier: MIT
"""The mesh files of other people's hands: found in packages, left out one by one."""

import numpy as np
import pytest
import trimesh

from vtgtsam import HandModel

URDF = """
<robot name="r">
  <link name="base">
    <collision name="pad_a"><origin xyz="0 0 0.02"/><geometry><box size="0.02 0.02 0.002"/></geometry></collision>
    <collision name="shape"><geometry><mesh filename="{file}"/></geometry></collision>
    <collision name="other"><geometry><mesh filename="package://gone/meshes/other.stl"/></geometry></collision>
  </link>
</robot>
"""


@pytest.fixture
def package(tmp_path):
    """A ROS package robot_description with meshes/ and urdf/."""
    folder = tmp_path / "robot_description"
    (folder / "meshes").mkdir(parents=True)
    (folder / "urdf").mkdir()
    trimesh.creation.box(extents=(0.03, 0.03, 0.03)).export(folder / "meshes/palm.stl")
    trimesh.creation.box(extents=(0.03, 0.03, 0.03)).export(folder / "meshes/palm.ply")
    return folder


def load(package, file):
    path = package / "urdf/hand.urdf"
    path.write_text(URDF.format(file=file))
    return HandModel.from_mjcf(path)


@pytest.mark.parametrize(
    "file",
    [
        "package://robot_description/meshes/palm.stl",
        "../meshes/palm.stl",
        "{folder}/meshes/palm.stl",
    ],
)
def test_a_mesh_is_found_in_its_package_and_beside_the_file(package, file, caplog):
    hand = load(package, file.format(folder=f"file://{package}" if "folder" in file else ""))
    assert hand.model.nmesh == 1
    assert "without mesh package://gone/meshes/other.stl, not found" in caplog.text


def test_a_package_beside_the_hands_own_is_found(package, tmp_path):
    package.joinpath("meshes").rename(tmp_path / "meshes_only")
    (tmp_path / "other_description/meshes").mkdir(parents=True)
    (tmp_path / "meshes_only/palm.stl").rename(tmp_path / "other_description/meshes/palm.stl")
    assert load(package, "package://other_description/meshes/palm.stl").model.nmesh == 1


def test_a_mesh_of_another_kind_is_left_out_by_name(package, caplog):
    (package / "meshes/palm.glb").write_bytes(b"glTF")
    assert load(package, "package://robot_description/meshes/palm.glb").model.nmesh == 0
    assert "palm.glb: read are STL, OBJ and PLY" in caplog.text


def test_a_ply_is_what_the_same_stl_is(package):
    stl = load(package, "../meshes/palm.stl").model
    ply = load(package, "package://robot_description/meshes/palm.ply").model
    assert stl.nmesh == ply.nmesh == 1
    np.testing.assert_allclose(stl.geom("shape").size, ply.geom("shape").size)


def test_a_urdf_of_looks_alone_is_seen(package):
    path = package / "urdf/hand.urdf"
    text = URDF.format(file="../meshes/palm.stl").replace('<collision name="pad_a">', "<PAD>")
    text = text.replace("collision", "visual").replace("<PAD>", '<visual name="pad_a">')
    path.write_text(text)
    hand = HandModel.from_mjcf(path)
    assert hand.model.nmesh == 1 and hand.pad_names == ("pad_a",)


def test_the_text_of_a_hand_that_needs_a_plugin_needs_none(tmp_path):
    path = tmp_path / "hand.xml"
    path.write_text(
        """<mujoco><extension><plugin plugin="mujoco.pid"><instance name="i"><config key="kp" value="1"/>
        </instance></plugin></extension><worldbody><body name="b"><joint name="j"/><geom size="0.01"/>
        <site name="pad_a" type="box" pos="0 0 0.012" size="0.01 0.01 0.001"/></body></worldbody>
        <actuator><plugin joint="j" plugin="mujoco.pid" instance="i"/></actuator></mujoco>"""
    )
    hand = HandModel.from_mjcf(path)
    assert "pid" not in hand.xml
    assert HandModel.from_text(hand.xml).joint_names == ("j",)


def test_a_flat_mesh_costs_no_other(package, tmp_path, caplog):
    sheet = trimesh.Trimesh(
        [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0.1, 0.1, 0]], [[0, 1, 2], [1, 3, 2]]
    )
    sheet.export(package / "meshes/sheet.stl")
    path = tmp_path / "hand.xml"
    path.write_text(
        f"""<mujoco><compiler meshdir="{package}/meshes"/>
        <asset><mesh file="sheet.stl"/><mesh file="palm.stl"/></asset>
        <worldbody><body name="b"><geom type="mesh" mesh="sheet"/><geom type="mesh" mesh="palm"/>
        <site name="pad_a" type="box" pos="0 0 0.02" size="0.01 0.01 0.001"/></body></worldbody></mujoco>"""
    )
    hand = HandModel.from_mjcf(path)
    assert hand.model.nmesh == 1
    assert "hand loaded without mesh sheet: mesh 'sheet' has coplanar vertices" in caplog.text
