# SPDX-License-Identifier: MIT
"""Joints that follow others, and chains that close."""

import numpy as np
import pytest

from vtgtsam import HandModel

CHAIN = """
<robot name="chain">
  <link name="base"><collision name="pad_a"><geometry><box size="0.02 0.02 0.002"/></geometry></collision></link>
  <link name="l1"/><link name="l2"/><link name="l3"/>
  <joint name="third" type="revolute"><parent link="l2"/><child link="l3"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/><mimic joint="second" multiplier="3" offset="0.1"/></joint>
  <joint name="second" type="revolute"><parent link="l1"/><child link="l2"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/><mimic joint="first" multiplier="2"/></joint>
  <joint name="first" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
</robot>
"""
CLOSED = """
<mujoco>
  <worldbody>
    <site name="pad_a" type="box" size="0.01 0.01 0.001"/>
    <body name="driver"><joint name="drive" axis="0 1 0"/><geom size="0.01"/></body>
    <body name="coupler" pos="0.1 0 0"><joint name="passive" axis="0 1 0"/><geom size="0.01"/></body>
  </worldbody>
  <equality><connect body1="driver" body2="coupler" anchor="0.05 0 0"/></equality>
</mujoco>
"""


def load(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text)
    return HandModel.from_mjcf(path)


def test_a_chain_of_mimic_joints_follows_in_whatever_order_it_is_declared(tmp_path):
    hand = load(tmp_path, "chain.urdf", CHAIN)
    assert hand.joint_names == ("first", "second", "third")
    np.testing.assert_allclose(hand.joint_array({"first": 0.2}), (0.2, 0.4, 1.3))
    swapped = (
        CHAIN.replace('"third"', '"x"').replace('"first"', '"third"').replace('"x"', '"first"')
    )
    hand = load(tmp_path, "swapped.urdf", swapped)
    np.testing.assert_allclose(hand.joint_array({"third": 0.2}), (0.2, 0.4, 1.3))


def test_a_chain_whose_first_joint_is_missing_lists_all_that_depend_on_it(tmp_path):
    hand = load(tmp_path, "chain.urdf", CHAIN)
    with pytest.raises(ValueError, match="missing for: first, second, third$"):
        hand.joint_array({"wrist": 0.2})


def test_a_closed_chain_is_named_where_its_passive_joint_is_missing(tmp_path):
    hand = load(tmp_path, "closed.xml", CLOSED)
    with pytest.raises(
        ValueError, match="missing for: passive; the hand has a closed chain .*driver to coupler"
    ):
        hand.joint_array({"drive": 0.2})
    np.testing.assert_allclose(hand.joint_array({"drive": 0.2, "passive": 0.1}), (0.2, 0.1))
