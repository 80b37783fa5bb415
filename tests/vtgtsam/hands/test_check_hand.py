# SPDX-License-Identifier: MIT
"""``check-hand`` and ``suggest-pads``: reports, pictures and proposals."""

import os

import numpy as np
import pytest
from menagerie import FOLDER, needs_menagerie
from PIL import Image
from typer.testing import CliRunner

from vtgtsam import HandModel, load_hand
from vtgtsam.cli import app
from vtgtsam.exceptions import HandError, VtgtsamError
from vtgtsam.hands.check import check_hand
from vtgtsam.hands.picture import SIDE, hand_picture
from vtgtsam.hands.suggest import pads_yaml, suggest_pads

DOCS = os.path.join(os.path.dirname(__file__), *[os.pardir] * 3, "docs", "hands")
# Two fingers that bend towards -y and a thumb against them; a knuckle that spreads; pads nowhere.
CLAW = """
<mujoco model="claw">
  <compiler angle="radian"/>
  <default><geom type="box" mass="0.01"/></default>
  <worldbody>
    <body name="palm">
      <geom size="0.04 0.01 0.05"/>
      {fingers}
    </body>
  </worldbody>
</mujoco>
"""
FINGER = """
      <body name="knuckle{n}" pos="{x} 0 0.06">
        <joint name="spread{n}" axis="0 1 0" range="-0.4 0.4"/>
        <geom size="0.008 0.008 0.005"/>
        <body name="proximal{n}" pos="0 0 0.01">
          <joint name="bend{n}" axis="1 0 0" range="-0.2 1.6"/>
          <geom size="0.01 0.008 0.018" pos="0 0 0.02"/>
          <body name="distal{n}" pos="0 0 0.04">
            <joint name="curl{n}" axis="-1 0 0" range="-1.6 0.1"/>
            <geom size="0.01 0.006 0.015" pos="0 0 0.016"/>
          </body>
        </body>
      </body>
"""


@pytest.fixture
def claw(tmp_path):
    path = tmp_path / "claw.xml"
    path.write_text(
        CLAW.format(fingers="".join(FINGER.format(n=n, x=x) for n, x in ((1, -0.03), (2, 0.03))))
    )
    return path


def run(*arguments):
    return CliRunner().invoke(app, list(map(str, arguments)))


def test_the_built_in_hand_has_no_problems_and_every_joint_and_pad_in_its_report():
    hand = load_hand("isyhand")
    report = check_hand(hand)
    assert report.problems == [] and report.notes == []
    text = str(report)
    assert all(f" {name} " in text for name in (*hand.joint_names, *hand.pad_names))
    assert "-11.5 to 90.0 deg" in text and text.endswith("no problems found")


def test_what_a_user_has_to_know_is_noted(tmp_path):
    path = tmp_path / "hand.xml"
    path.write_text(
        """<mujoco><worldbody><geom type="plane" size="1 1 1"/>
        <body name="a"><joint name="1" axis="0 1 0"/><geom size="0.01"/>
        <site name="pad_a" type="box" pos="0 0 0.012" size="0.01 0.01 0.001"/></body>
        <body name="b" pos="0.1 0 0"><joint name="0" axis="0 1 0"/><geom size="0.01"/></body></worldbody>
        <equality><weld body1="a" body2="b"/><joint joint1="0" joint2="1"/></equality></mujoco>"""
    )
    report = check_hand(HandModel.from_mjcf(path))
    closed, order, floor = report.notes
    assert "a chain between a and b" in closed and "order 1, 0" in order and "a floor" in floor
    assert any("moves b  follows 1" in line for line in report.lines)


def test_a_hand_whose_pads_are_metres_apart_is_a_problem(tmp_path):
    path = tmp_path / "hand.xml"
    sites = "".join(
        f'<site name="pad_{i}" type="box" pos="{40 * i} 0 0" size="0.1 0.1 0.01"/>'
        for i in range(3)
    )
    path.write_text(f"<mujoco><worldbody>{sites}</worldbody></mujoco>")
    report = check_hand(HandModel.from_mjcf(path))
    assert any("80 m apart: is the file in millimetres" in problem for problem in report.problems)
    assert any("no shapes" in note for note in report.notes)


def test_the_picture_shows_faces_blue_in_front_and_red_from_behind(tmp_path):
    path = tmp_path / "hand.xml"
    text = """<mujoco><worldbody><body name="a"><joint name="j" axis="1 0 0"/>
    <geom type="box" size="0.05 0.01 0.002"/>
    <site name="pad_a" type="box" pos="0 0 0.003" size="0.02 0.02 0.001" {turn}/></body></worldbody></mujoco>"""
    counts = []
    for turn in ("", 'euler="180 0 0"'):
        path.write_text(text.format(turn=turn))
        image = np.asarray(hand_picture(HandModel.from_mjcf(path))).astype(int)
        views = [image[:SIDE, :SIDE], image[:SIDE, SIDE : 2 * SIDE]]
        blue = [(v[..., 2] > v[..., 0] + 60).sum() for v in views]
        red = [(v[..., 0] > v[..., 2] + 60).sum() for v in views]
        counts.append((blue, red))
    (blue, red), (blue_turned, _) = counts
    assert (
        blue[0] > 5000 > blue[1] and red[1] > 1000 > red[0]
    )  # half of its back stands out of the link
    assert (
        blue_turned[0] < blue[0]
    )  # now looked at from below, where the link hides half of the face


def test_pads_are_proposed_on_the_palm_side_of_links_that_bend(claw):
    entries = {entry.body: entry for entry in suggest_pads(claw)}
    assert set(entries) == {"palm", "proximal1", "distal1", "proximal2", "distal2"}
    for name, depth in (("palm", 0.01), ("proximal1", 0.008), ("distal2", 0.006)):
        entry = entries[name]
        np.testing.assert_allclose(entry.normal, (0, -1, 0), atol=1e-9)
        np.testing.assert_allclose(entry.pos[1], -depth, atol=1e-9)
        assert min(entry.size) >= 0.016
    assert entries["proximal1"].pos[2] + entries["proximal1"].size[1] / 2 <= 0.04


def test_jaws_that_slide_get_pads_that_face_each_other(tmp_path):
    path = tmp_path / "jaws.xml"
    jaw = """<body name="{n}" pos="0 0 0.05"><joint name="{n}" type="slide" axis="{axis}" range="0 0.04"/>
    <geom type="box" pos="0 {y} 0.02" size="0.01 0.004 0.02"/></body>"""
    jaws = jaw.format(n="left", axis="0 1 0", y=0.004) + jaw.format(
        n="right", axis="0 -1 0", y=-0.004
    )
    path.write_text(
        f'<mujoco><worldbody><body name="hand"><geom size="0.03"/>{jaws}</body></worldbody></mujoco>'
    )
    left, right = (entry for entry in suggest_pads(path) if entry.body != "hand")
    assert left.normal == (0, -1, 0) and right.normal == (0, 1, 0)
    assert left.pos[1] == right.pos[1] == 0
    out = tmp_path / "pads.yaml"
    out.write_text(pads_yaml(suggest_pads(path), "jaws.xml"))
    assert check_hand(load_hand(out)).problems == []


def test_what_is_proposed_is_a_hand_without_problems(claw, tmp_path):
    out = tmp_path / "pads.yaml"
    proposed = run("suggest-pads", claw, "--out", out)
    assert proposed.exit_code == 0 and "5 pads proposed" in proposed.stdout
    checked = run("check-hand", out, "--out", tmp_path / "hand.png")
    assert checked.exit_code == 0 and "no problems found" in checked.stdout
    with Image.open(tmp_path / "hand.png") as picture:
        assert picture.size[0] > 2 * SIDE
    again = run("suggest-pads", claw, "--out", out)
    assert isinstance(again.exception, VtgtsamError) and "--force" in str(again.exception)


def test_a_pad_inside_its_link_makes_the_exit_code_1(claw, tmp_path):
    pads = tmp_path / "pads.yaml"
    pads.write_text("pads: [{name: a, body: palm, pos: [0, 0, 0], normal: -y, size: [0.02, 0.02]}]")
    checked = run("check-hand", claw, "--pads", pads, "--out", tmp_path / "hand.png")
    assert checked.exit_code == 1 and "problem: 100 % of the face of pad 'a'" in checked.stdout


def test_a_hand_that_nothing_can_be_proposed_for_says_why(tmp_path):
    path = tmp_path / "rod.xml"
    path.write_text(
        '<mujoco><worldbody><body name="a"><geom size="0.01"/></body></worldbody></mujoco>'
    )
    with pytest.raises(HandError, match="no link that bends one way has a shape"):
        suggest_pads(path)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("isyhand", "--out", "hand.pdf"), "pictures are written as .png"),
        (("isyhand", "--pads", "a.yaml", "--out", "hand.png"), "--pads needs the hand's file"),
        (("leap", "--out", "hand.png"), "unknown hand 'leap'"),
    ],
)
def test_what_cannot_be_done_is_said(arguments, message):
    done = run("check-hand", *arguments)
    assert isinstance(done.exception, HandError) and message in str(done.exception)


@needs_menagerie
@pytest.mark.parametrize(
    ("hand", "pads", "count"),
    [
        ("wonik_allegro/right_hand.xml", "allegro_right.yaml", 16),
        ("leap_hand/right_hand.xml", "leap_right.yaml", 12),
    ],
)
def test_the_pads_files_for_menagerie_lie_right_on_its_hands(hand, pads, count):
    model = HandModel.from_mjcf(FOLDER / hand, pads=os.path.join(DOCS, pads))
    report = check_hand(model)
    assert report.problems == [] and len(model.pads) == count
    np.testing.assert_allclose(
        HandModel.from_text(model.xml).pad_transforms(np.zeros(16)),
        model.pad_transforms(np.zeros(16)),
        atol=1e-6,  # MuJoCo writes six digits
    )


@needs_menagerie
@pytest.mark.parametrize(
    "hand", ["wonik_allegro/right_hand", "leap_hand/right_hand", "shadow_hand/left_hand"]
)
def test_pads_can_be_proposed_for_menageries_hands(hand, tmp_path):
    path = FOLDER / f"{hand}.xml"
    out = tmp_path / "pads.yaml"
    out.write_text(pads_yaml(suggest_pads(path), str(path)))
    assert check_hand(load_hand(out)).problems == []
