# SPDX-License-Identifier: MIT
"""Hands other than the built-in one, written here: MJCF and URDF."""

import copy
import pickle

import gtsam
import numpy as np
import pytest

from vtgtsam import HandModel, Pad, PadSet, load_hand
from vtgtsam.exceptions import HandError

MJCF = """
<mujoco model="pincer">
  <compiler angle="radian"/>
  <worldbody>
    <body name="palm" pos="0 0 0.1">
      <geom type="box" size="0.05 0.05 0.01"/>
      <site name="pad_palm" type="box" pos="0 0 0.011" size="0.03 0.02 0.001"/>
      <body name="finger" pos="0.05 0 0">
        <joint name="swing" axis="0 0 1"/>
        <joint name="bend" axis="0 -1 0"/>
        <geom type="capsule" fromto="0 0 0 0.04 0 0" size="0.01"/>
        <site name="pad_finger" type="box" pos="0.02 0.01 0" size="0.015 0.005 0.002"
              xyaxes="1 0 0 0 0 -1"/>
        <site name="marker" type="box" size="0.01 0.01 0.01"/>
      </body>
      <body name="slider" pos="-0.05 0 0">
        <joint name="slide" type="slide" axis="1 0 0"/>
        <geom type="sphere" size="0.01"/>
        <site name="pad_slider" type="box" pos="0 0 0.01" size="0.01 0.01 0.001"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""

URDF = """
<robot name="gripper">
  <link name="base">
    <visual><geometry><mesh filename="package://gone/base.stl"/></geometry></visual>
    <collision name="pad_base">
      <origin xyz="0 0 0.01"/><geometry><box size="0.05 0.04 0.004"/></geometry>
    </collision>
  </link>
  <joint name="left" type="revolute">
    <parent link="base"/><child link="left_finger"/>
    <origin xyz="0.1 0 0" rpy="0 0 0.3"/><axis xyz="0 -1 0"/>
    <limit lower="0" upper="1.5" effort="1" velocity="1"/>
  </joint>
  <link name="left_finger">
    <collision><geometry><mesh filename="package://gone/finger.stl"/></geometry></collision>
  </link>
  <joint name="glue" type="fixed">
    <parent link="left_finger"/><child link="pad_tip"/><origin xyz="0.03 0 0.01"/>
  </joint>
  <link name="pad_tip">
    <collision><geometry><box size="0.02 0.018 0.004"/></geometry></collision>
  </link>
  <joint name="right" type="revolute">
    <parent link="base"/><child link="right_finger"/><axis xyz="0 -1 0"/>
    <limit lower="0" upper="1.5" effort="1" velocity="1"/>
    <mimic joint="left" multiplier="0.5" offset="0.1"/>
  </joint>
  <link name="right_finger"/>
</robot>
"""


@pytest.fixture
def pincer(tmp_path):
    path = tmp_path / "pincer.xml"
    path.write_text(MJCF)
    return HandModel.from_mjcf(path)


@pytest.fixture
def gripper(tmp_path):
    path = tmp_path / "gripper.urdf"
    path.write_text(URDF)
    return HandModel.from_mjcf(path)


def turn(axis, angle):
    """Rotation about a coordinate axis, written out."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    R = np.eye(3)
    R[i, i], R[j, j], R[i, j], R[j, i] = c, c, -s, s
    return R


def test_names_and_sizes_come_from_the_file(pincer):
    assert pincer.name == "pincer"
    assert pincer.joint_names == ("swing", "bend", "slide")
    assert pincer.pad_names == ("pad_palm", "pad_finger", "pad_slider")
    np.testing.assert_allclose([pad.size for pad in pincer.pads[:2]], [(0.06, 0.04), (0.03, 0.01)])


def test_a_pads_origin_is_the_centre_of_its_outer_face(pincer):
    T_hp = pincer.pad_transforms([0.0, 0.0, 0.0])
    np.testing.assert_allclose(T_hp[0, :3, 3], (0, 0, 0.1 + 0.011 + 0.001), atol=1e-12)
    np.testing.assert_allclose(T_hp[1, :3, 3], (0.07, 0.01 + 0.002, 0.1), atol=1e-12)
    np.testing.assert_allclose(T_hp[1, :3, :3], [[1, 0, 0], [0, 0, 1], [0, -1, 0]], atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_pads_follow_the_joints(pincer, seed):
    swing, bend, slide = np.random.default_rng(seed).uniform(-1, 1, 3)
    R = turn("z", swing) @ turn("y", -bend)
    expected = np.array([0.05, 0, 0.1]) + R @ (0.02, 0.012, 0)
    T_hp = pincer.pad_transforms([swing, bend, slide])
    np.testing.assert_allclose(T_hp[1, :3, 3], expected, atol=1e-12)
    np.testing.assert_allclose(T_hp[1, :3, 2], R @ (0, 1, 0), atol=1e-12)
    np.testing.assert_allclose(T_hp[2, :3, 3], (slide - 0.05, 0, 0.111), atol=1e-12)


def test_T_wh_moves_all_pads(pincer):
    T_wh = gtsam.Pose3(gtsam.Rot3.Ypr(0.3, -0.2, 1.0), np.array([0.1, 0.2, 0.3]))
    T_hp = pincer.pad_transforms([0.1, 0.2, 0.01])
    for given in (T_wh, T_wh.matrix()):
        T_wp = pincer.pad_transforms([0.1, 0.2, 0.01], given)
        np.testing.assert_allclose(T_wp, T_wh.matrix() @ T_hp, atol=1e-12)


def test_points_are_each_pads_grid_at_its_pose(pincer):
    q = [0.4, -0.3, 0.02]
    points, offsets = pincer.pad_points(q)
    assert offsets.tolist() == [0, *np.cumsum([len(pad.points_p) for pad in pincer.pads])]
    for k, (pad, T) in enumerate(zip(pincer.pads, pincer.pad_transforms(q), strict=True)):
        expected = (T @ np.column_stack([pad.points_p, np.ones(len(pad.points_p))]).T).T[:, :3]
        np.testing.assert_allclose(points[offsets[k] : offsets[k + 1]], expected, atol=1e-12)


def test_joints_by_name_in_any_order_with_others_ignored(pincer):
    by_name = {"slide": 0.01, "elbow": 9.0, "bend": 0.2, "swing": 0.1}
    np.testing.assert_array_equal(
        pincer.pad_transforms(by_name), pincer.pad_transforms([0.1, 0.2, 0.01])
    )


def test_missing_joints_are_all_listed(pincer):
    with pytest.raises(ValueError, match="missing for: swing, slide"):
        pincer.pad_transforms({"bend": 0.2})


@pytest.mark.parametrize("joints", [[0.0, 0.0], np.zeros((1, 3)), 0.5])
def test_an_array_of_the_wrong_shape_is_refused(pincer, joints):
    with pytest.raises(ValueError, match="must be 3 angles"):
        pincer.pad_transforms(joints)


def test_angles_that_are_not_finite_are_named(pincer):
    with pytest.raises(ValueError, match="not: bend, slide"):
        pincer.pad_transforms([0.0, np.nan, np.inf])


def test_a_T_wh_of_the_wrong_shape_is_refused(pincer):
    for wrong in (np.eye(3), [1, 2, 3], "world", np.full((4, 4), "a")):
        with pytest.raises(ValueError, match=r"T_wh must be a Pose3 or have shape \(4, 4\), got"):
            pincer.pad_transforms([0, 0, 0], wrong)
    rows = np.eye(4).tolist()
    np.testing.assert_array_equal(
        pincer.pad_transforms([0, 0, 0], rows), pincer.pad_transforms([0, 0, 0])
    )


def test_copies_and_pickles_are_independent(pincer):
    q = [0.1, 0.2, 0.01]
    expected = pincer.pad_transforms(q)
    for other in (copy.copy(pincer), copy.deepcopy(pincer), pickle.loads(pickle.dumps(pincer))):
        other.pad_transforms([1.0, 1.0, 1.0])
        np.testing.assert_array_equal(other.pad_transforms(q), expected)
        assert other.pad_names == pincer.pad_names


def test_a_urdf_loads_without_its_meshes(gripper):
    assert gripper.joint_names == ("left", "right")
    assert gripper.pad_names == ("pad_base", "pad_tip")
    T_hp = gripper.pad_transforms([0.4, 0.0])
    np.testing.assert_allclose(T_hp[0, :3, 3], (0, 0, 0.012), atol=1e-12)
    R = turn("z", 0.3) @ turn("y", -0.4)
    np.testing.assert_allclose(
        T_hp[1, :3, 3], (0.1, 0, 0) + R @ (0.03, 0, 0.012), atol=1e-9
    )  # MuJoCo keeps a URDF's angles to about 1e-10 rad


def test_a_mimic_joint_may_be_left_out(gripper):
    np.testing.assert_allclose(gripper.joint_array({"left": 0.6}), (0.6, 0.4))
    np.testing.assert_allclose(gripper.joint_array({"left": 0.6, "right": 0.5}), (0.6, 0.5))


def test_the_text_of_a_hand_is_enough_to_build_it_again(pincer, gripper):
    for hand, q in ((pincer, [0.4, 0.3, 0.01]), (gripper, [0.3, 0.2])):
        again = HandModel.from_text(hand.xml)
        assert again.pad_names == hand.pad_names
        # MuJoCo writes six digits.
        np.testing.assert_allclose(again.pad_transforms(q), hand.pad_transforms(q), atol=1e-6)


def test_other_pad_names_are_found_and_kept_in_the_text(tmp_path):
    path = tmp_path / "hand.xml"
    path.write_text(MJCF.replace("pad_", "skin_"))
    hand = HandModel.from_mjcf(path, pads="skin_*r")
    assert hand.pad_names == ("skin_finger", "skin_slider")
    assert HandModel.from_text(hand.xml).pad_names == hand.pad_names


def test_box_geoms_are_pads_where_no_site_is(tmp_path):
    path = tmp_path / "hand.xml"
    path.write_text(MJCF.replace("<site", "<geom"))
    sites = tmp_path / "sites.xml"
    sites.write_text(MJCF)
    q = [0.3, 0.2, 0.01]
    np.testing.assert_allclose(
        HandModel.from_mjcf(path).pad_transforms(q), HandModel.from_mjcf(sites).pad_transforms(q)
    )


def test_geoms_beside_sites_of_such_names_are_said_to_be_none(tmp_path, caplog):
    path = tmp_path / "hand.xml"
    geom = '<geom name="pad_extra" type="box" pos="0 0 0.011" size="0.01 0.01 0.001"/>'
    path.write_text(MJCF.replace("<site", geom + "<site", 1))
    assert "pad_extra" not in HandModel.from_mjcf(path).pad_names
    assert "geoms of such names are none: pad_extra" in caplog.text


def test_a_floating_base_and_a_xacro_named_urdf_say_what_to_do(tmp_path):
    path = tmp_path / "hand.urdf"
    path.write_text(
        '<robot name="x"><link name="w"/><joint name="f" type="floating"><parent link="w"/><child link="b"/>'
        '</joint><link name="b"><collision name="pad_a"><geometry><box size=".04 .04 .003"/></geometry>'
        "</collision></link></robot>"
    )
    with pytest.raises(HandError, match="make the floating joint fixed"):
        HandModel.from_mjcf(path)
    path.write_text('<robot name="x"><xacro:finger/></robot>')
    with pytest.raises(HandError, match="xacro hand.urdf > hand_expanded.urdf"):
        HandModel.from_mjcf(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('type="slide" axis="1 0 0"', 'type="ball"', "joint 'slide' is a ball joint"),
        ('<joint name="swing"', "<joint", "'finger' has no name"),
        ('"0 0 0.1">', '"0 0 0.1"><freejoint/>', "'palm' has a free joint; remove it"),
        ('type="box" pos="0 0 0.011"', 'type="ellipsoid" pos="0 0 0.011"', "not so: pad_palm"),
        ("pad_", "skin_", "no box site or box geom is named 'pad_.*marker.*skin_palm"),
        ("pad_", "skin_", "Name the pads' box sites pad_., or say which boxes.* topic map.* YAML"),
        ("<body", "<bodi", "hand.xml, line [0-9]+: not valid XML; look for"),
        ('type="box"', 'tipe="box"', "MuJoCo 3.* understands: .*attribute: 'tipe'"),
        ('<joint name="bend"', '<joint name="swing"', "MuJoCo cannot .*repeated name 'swing'"),
        ("<mujoco", "<mjcf", "is neither MJCF .its root would be <mujoco>. nor URDF"),
        (
            "<mujoco",
            '<!-- made --><?xml version="1.0"?><mujoco',
            "line [0-9]: something stands before <.xml",
        ),
        (
            "<worldbody>",
            '<include file="more.xml"/><worldbody>',
            "includes a file that is not there",
        ),
        ("<body", "<xacro:finger/><body", "is a xacro file.*: xacro hand.xml > hand.urdf"),
        ('axis="0 -1 0"', 'axis="0 0 0"', "cannot use this hand"),
    ],
)
def test_a_hand_that_cannot_be_used_is_refused_with_a_reason(tmp_path, old, new, message):
    path = tmp_path / "hand.xml"
    text = MJCF.replace(old, new)
    assert text != MJCF
    path.write_text(text)
    with pytest.raises(HandError, match=message) as caught:
        HandModel.from_mjcf(path)
    assert "\n" not in str(caught.value)


def test_an_unknown_hand_lists_the_known_ones():
    with pytest.raises(HandError, match="unknown hand 'leap': expected one of isyhand"):
        load_hand("leap")


def test_load_hand_takes_a_path_as_text(tmp_path):
    path = tmp_path / "pincer.xml"
    path.write_text(MJCF)
    assert load_hand(str(path)).name == "pincer"


def test_files_with_another_ending_are_to_be_renamed(tmp_path):
    for name, wanted in (("hand.mjcf", "hand.xml"), ("hand", "hand.xml")):
        (tmp_path / name).write_text(MJCF)
        with pytest.raises(HandError, match=f"rename .*{name} to {wanted}"):
            load_hand(tmp_path / name)
    (tmp_path / "hand.txt").write_text(URDF)
    with pytest.raises(HandError, match="rename .*hand.txt to hand.urdf"):
        load_hand(tmp_path / "hand.txt")


def test_a_comment_in_latin_1_does_no_harm(tmp_path):
    path = tmp_path / "pincer.xml"
    path.write_bytes(MJCF.replace("<mujoco", "<!-- Gr\xfc\xdfe --><mujoco").encode("latin-1"))
    hand = load_hand(path)
    assert HandModel.from_text(hand.xml).pad_names == hand.pad_names


def test_a_pad_that_is_a_cylinder_is_named(tmp_path):
    path = tmp_path / "gripper.urdf"
    cylinder = '<cylinder radius="0.01" length="0.004"/>'
    path.write_text(URDF.replace('<box size="0.05 0.04 0.004"/>', cylinder))
    with pytest.raises(HandError, match="pads must be boxes, these geoms .* are not: pad_base"):
        load_hand(path)


def test_several_unnamed_boxes_of_one_link_are_explained(tmp_path):
    path = tmp_path / "hand.xml"
    boxes = '<geom type="box" size="0.01 0.01 0.01"/>' * 3
    path.write_text(f'<mujoco><worldbody><body name="pad_link">{boxes}</body></worldbody></mujoco>')
    with pytest.raises(HandError, match="'pad_link' has 3 boxes without a name.*YAML file of pads"):
        load_hand(path)


def test_a_hand_in_millimetres_is_refused_by_its_pads(tmp_path):
    path = tmp_path / "hand.xml"
    path.write_text(MJCF.replace("0.03 0.02 0.001", "30 20 1"))
    with pytest.raises(
        HandError, match="60 x 40 m, more than 0.5 m: it is probably in millimetres"
    ):
        load_hand(path)


def test_a_long_list_of_boxes_is_cut(tmp_path):
    path = tmp_path / "hand.xml"
    boxes = "".join(f'<geom name="b{i}" type="box" size="0.01 0.01 0.01"/>' for i in range(40))
    path.write_text(f"<mujoco><worldbody>{boxes}</worldbody></mujoco>")
    with pytest.raises(HandError, match="and 28 more") as caught:
        load_hand(path)
    assert len(str(caught.value)) < 500


def test_numbered_joints_out_of_order_are_said(tmp_path, caplog):
    path = tmp_path / "hand.xml"
    text = MJCF
    for name, number in (("swing", "1"), ("bend", "0"), ("slide", "2")):
        text = text.replace(f'name="{name}"', f'name="{number}"')
    path.write_text(text)
    load_hand(path)
    assert "in the order 1, 0, 2; an array of angles goes in this order" in caplog.text
    caplog.clear()
    path.write_text(MJCF)
    load_hand(path)
    assert caplog.text == ""


@pytest.mark.parametrize("wrong", [None, 3, ["isyhand"], load_hand])
def test_a_hand_is_named_or_a_path(wrong):
    with pytest.raises(ValueError, match="given by its name or the path of its file, got"):
        load_hand(wrong)
    with pytest.raises(ValueError, match="a hand's file is a path, and its pads a pattern"):
        HandModel.from_mjcf("hand.xml", pads=wrong)


@pytest.mark.parametrize(
    ("pads", "message"),
    [
        ("pads", "a list of Pad, got 'p' in it"),
        (3, "a list of Pad, got 3"),
        ([("a", (0.02, 0.02))], r"a list of Pad, got \('a'"),
    ],
)
def test_a_pad_set_is_made_of_pads(pads, message):
    with pytest.raises(ValueError, match=message):
        PadSet(pads)
    with pytest.raises(ValueError, match="a pad's name is a text, got 3"):
        Pad(3, (0.02, 0.02))
