# SPDX-License-Identifier: MIT
"""Pads from a YAML file beside a hand's file that stays as its maker wrote it."""

import numpy as np
import pytest

from vtgtsam import HandModel, load_hand
from vtgtsam.exceptions import HandError

HAND = """
<mujoco model="plain">
  <worldbody>
    <body name="palm">
      <geom type="box" pos="0 0 0.1" size="0.04 0.05 0.01"/>
      <geom type="box" pos="0 0.2 0.1" size="0.01 0.02 0.03"/>
      <body name="finger" pos="0.05 0 0.1">
        <joint name="0" axis="0 -1 0" range="-10 90"/>
        <geom name="link" type="box" pos="0.03 0 0" size="0.03 0.01 0.008" euler="0 0 90"/>
        <geom name="tip" type="sphere" pos="0.07 0 0" size="0.01"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
PALM = "{name: palm, body: palm, geom: 0, face: +z}"


@pytest.fixture
def hand(tmp_path):
    path = tmp_path / "plain.xml"
    path.write_text(HAND)
    return path


@pytest.fixture
def with_pads(hand, tmp_path):
    """A hand with these pads, and what is read again from its text."""

    def load(*entries):
        path = tmp_path / "pads.yaml"
        path.write_text("pads:\n" + "".join(f"  - {entry}\n" for entry in entries))
        return HandModel.from_mjcf(hand, pads=path)

    return load


def test_a_pad_is_placed_by_its_faces_centre_and_normal(with_pads):
    hand = with_pads(
        "{name: a, body: finger, pos: [0.03, 0, -0.009], normal: -z, size: [0.03, 0.01]}"
    )
    (T,) = hand.pad_transforms({"0": 0.0})
    np.testing.assert_allclose(T[:3, 3], (0.08, 0, 0.091), atol=1e-12)
    np.testing.assert_allclose(T[:3, :3], np.diag([1, -1, -1]), atol=1e-12)
    np.testing.assert_allclose(hand.pads[0].size, (0.03, 0.01))


def test_a_normal_of_three_numbers_need_not_have_length_one(with_pads):
    hand = with_pads(
        "{name: a, body: finger, pos: [0, 0, 0], normal: [0, 3, 4], size: [0.01, 0.02]}"
    )
    (T,) = hand.pad_transforms([0.0])
    np.testing.assert_allclose(T[:3, 2], (0, 0.6, 0.8), atol=1e-12)
    np.testing.assert_allclose(T[:3, 0], (1, 0, 0), atol=1e-12)


def test_the_length_lies_where_along_says(with_pads):
    hand = with_pads(
        "{name: a, body: finger, pos: [0, 0, 0], normal: +z, along: [0, 1, 1], size: [0.02, 0.01]}"
    )
    (T,) = hand.pad_transforms([0.0])
    np.testing.assert_allclose(T[:3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-12)


@pytest.mark.parametrize(
    ("face", "center", "normal", "sides"),
    [
        ("+x", (0.01, 0.2, 0.1), (1, 0, 0), (0.04, 0.06)),
        ("-x", (-0.01, 0.2, 0.1), (-1, 0, 0), (0.04, 0.06)),
        ("+y", (0, 0.22, 0.1), (0, 1, 0), (0.02, 0.06)),
        ("-y", (0, 0.18, 0.1), (0, -1, 0), (0.02, 0.06)),
        ("+z", (0, 0.2, 0.13), (0, 0, 1), (0.02, 0.04)),
        ("-z", (0, 0.2, 0.07), (0, 0, -1), (0.02, 0.04)),
    ],
)
def test_a_pad_is_a_face_of_one_of_several_unnamed_boxes(with_pads, face, center, normal, sides):
    hand = with_pads(f'{{name: a, body: palm, geom: 1, face: "{face}"}}')
    (T,) = hand.pad_transforms([0.0])
    np.testing.assert_allclose(T[:3, 3], center, atol=1e-12)
    np.testing.assert_allclose(T[:3, 2], normal, atol=1e-12)
    np.testing.assert_allclose(hand.pads[0].size, sides, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(T[:3, :3]), 1)


def test_a_face_follows_the_boxs_own_axes(with_pads):
    hand = with_pads("{name: a, geom: link, face: +x, size: [0.01, 0.012]}")
    (T,) = hand.pad_transforms([0.0])
    np.testing.assert_allclose(T[:3, 3], (0.05 + 0.03, 0.03, 0.1), atol=1e-9)
    np.testing.assert_allclose(T[:3, 2], (0, 1, 0), atol=1e-9)
    np.testing.assert_allclose(hand.pads[0].size, (0.01, 0.012))


def test_the_hands_text_keeps_the_pads_bit_by_bit(with_pads):
    hand = with_pads(
        PALM,
        "{name: 7, body: finger, pos: [0.0123456789, 0, 0.008], normal: +z, size: [0.02, 0.01]}",
    )
    again = HandModel.from_text(hand.xml)
    assert again.pad_names == hand.pad_names == ("palm", "7")
    np.testing.assert_array_equal(again._T_bp[1], hand._T_bp[1])
    np.testing.assert_allclose(again._T_bp[0], hand._T_bp[0], atol=1e-6)


def test_a_pads_file_that_names_its_hand_is_a_hand(hand, tmp_path):
    path = tmp_path / "pads.yml"
    path.write_text(f"hand: plain.xml\npads: [{PALM}]\n")
    assert load_hand(path).pad_names == ("palm",)
    path.write_text(f"pads: [{PALM}]\n")
    with pytest.raises(HandError, match="does not say of which hand; add a line 'hand: '"):
        load_hand(path)


def test_a_joint_named_by_a_number_may_be_a_number_in_a_mapping(with_pads):
    hand = with_pads(PALM)
    np.testing.assert_array_equal(hand.joint_array({0: 0.5}), [0.5])


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("{name: a}", "pad 'a' lacks body, pos, normal, size; a pad needs"),
        ("{name: a, body: palm, geom: 0}", "which face of the geom"),
        ("{name: a, face: +x}", "which geom\\? give its name"),
        ("{name: a, geom: link, face: +x, pos: [0, 0, 0]}", "one or the other"),
        ("{name: a, geom: link, face: up}", r"pads\.0\.face"),
        ("{name: a, geom: nail, face: +x}", "no geom 'nail'; its boxes with a name are: link"),
        ("{name: a, geom: tip, face: +x}", "'tip' is not a box"),
        ("{name: a, body: palm, face: +x}", "'palm' has 2 boxes; say which"),
        ("{name: a, body: palm, geom: 2, face: +x}", "'palm' has 2 boxes; say which"),
        (
            "{name: a, body: thumb, pos: [0, 0, 0], normal: +x, size: [0.01, 0.01]}",
            "no body 'thumb'; its bodies are: world, palm, finger",
        ),
        (
            "{name: a, body: palm, pos: [0, 0], normal: +x, size: [0.01, 0.01]}",
            r"pads\.0\.pos",
        ),
        (
            "{name: a, body: palm, pos: [0, 0, 0], normal: [0, 0, 0], size: [0.01, 0.01]}",
            "must not be zero",
        ),
        (
            "{name: a, body: palm, pos: [0, 0, 0], normal: +x, along: -x, size: [0.01, 0.01]}",
            "along must not be the normal's",
        ),
        (
            "{name: a, body: palm, pos: [0, 0, 0], normal: +x, size: [0.01, -0.01]}",
            r"pads\.0\.size\.1",
        ),
        (
            "{name: a, body: palm, pos: [0, 0, 0], normal: +x, size: [10, 12]}",
            "10 x 12 m, more than 0.5 m: it is probably in millimetres",
        ),
        ("{name: a, colour: red}", "unknown entry 'pads.0.colour'"),
        (f"{PALM}\n  - {PALM}", "pad names must be unique, these occur twice: palm"),
        ("{name: a", "not valid YAML"),
    ],
)
def test_a_pads_file_that_cannot_be_used_is_refused_in_a_sentence(with_pads, entry, message):
    with pytest.raises(HandError, match=message) as caught:
        with_pads(entry)
    assert "\n" not in str(caught.value)


def test_a_pads_file_without_pads_is_refused(hand, tmp_path):
    for text in ("", "pads: []", "taxels: []", "[[[["):
        (tmp_path / "pads.yaml").write_text(text)
        with pytest.raises(HandError, match="pads.yaml"):
            HandModel.from_mjcf(hand, pads=tmp_path / "pads.yaml")
    with pytest.raises(HandError, match="cannot read the pads file"):
        HandModel.from_mjcf(hand, pads=tmp_path / "none.yaml")
