# SPDX-License-Identifier: MIT
"""Pads whose face lies inside a link or looks the wrong way are noticed."""

import logging

import numpy as np
import pytest

from vtgtsam import HandModel, load_hand
from vtgtsam.exceptions import HandError
from vtgtsam.hands.placement import placements

HAND = """
<mujoco model="block">
  <worldbody>
    <body name="palm">
      <geom type="box" size="0.04 0.05 0.01"/>
      <site name="pad_a" type="box" {site}/>
      <body name="finger" pos="0.1 0 0">
        <joint name="bend" axis="0 -1 0" range="0 90"/>
        <geom type="box" size="0.03 0.01 0.01"/>
        <site name="pad_b" type="box" pos="0 0 0.011" size="0.02 0.008 0.001"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def hand_with(tmp_path, site):
    path = tmp_path / "block.xml"
    path.write_text(HAND.format(site=site))
    return HandModel.from_mjcf(path)


def test_pads_that_stand_on_their_links_are_right(tmp_path, caplog):
    hand = hand_with(tmp_path, 'pos="0 0 0.011" size="0.02 0.02 0.001"')
    for place in placements(hand):
        assert place.inside == 0 and place.depth == 0 and not place.on_edge and place.other is None
        np.testing.assert_allclose(place.floats, 0.002, atol=1e-12)
    assert caplog.text == ""


def test_the_built_in_hands_pads_are_right():
    assert all(
        p.inside == 0 and not p.on_edge and p.floats < 0.002
        for p in placements(load_hand("isyhand"))
    )


def test_a_face_inside_its_link_says_how_far_out_it_belongs(tmp_path, caplog):
    hand = hand_with(tmp_path, 'pos="0 0 0.004" size="0.02 0.02 0.001"')
    palm, finger = placements(hand)
    assert palm.inside == 1 and finger.inside == 0
    np.testing.assert_allclose(palm.depth, 0.005, atol=1e-9)
    assert "100 % of the face of pad 'pad_a' lies inside its own link 'palm'" in caplog.text
    assert "the face lie 5.0 mm further out" in caplog.text


def test_a_face_that_looks_into_its_link_is_noticed(tmp_path, caplog):
    hand_with(tmp_path, 'pos="0 0 0.011" size="0.02 0.02 0.001" euler="180 0 0"')
    assert "'pad_a' lies inside its own link" in caplog.text and "must point out" in caplog.text


def test_a_box_on_edge_is_noticed_or_refused(tmp_path, caplog):
    hand_with(tmp_path, 'pos="0.048 0 0" size="0.008 0.02 0.02"')
    assert "whose +z face touches, and z is not its thinnest side" in caplog.text
    with pytest.raises(
        HandError, match=r"a box of 3 x 40 x 40 mm, thin along its x axis.*face: \+x"
    ):
        hand_with(tmp_path, 'pos="0.042 0 0" size="0.0015 0.02 0.02"')


def test_a_pad_that_floats_and_one_in_another_link_are_noticed(tmp_path, caplog):
    hand_with(tmp_path, 'pos="0 0 0.15" size="0.02 0.02 0.001"')
    assert "'pad_a' floats 141 mm above its link 'palm'" in caplog.text
    caplog.clear()
    hand = hand_with(tmp_path, 'pos="0.1 0 0" size="0.008 0.008 0.001"')
    assert placements(hand)[0].other == "finger"
    assert "lies inside the link 'finger'" in caplog.text


def test_a_text_of_a_recording_is_not_looked_over_again(tmp_path, caplog):
    hand = hand_with(tmp_path, 'pos="0 0 0.004" size="0.02 0.02 0.001"')
    caplog.clear()
    with caplog.at_level(logging.WARNING):
        HandModel.from_text(hand.xml)
    assert caplog.text == ""
