# SPDX-License-Identifier: MIT
import numpy as np
import pytest

from vtgtsam import load_hand
from vtgtsam.exceptions import HandError
from vtgtsam.grasp.description import Palm, load_grasp

HAND = """
<mujoco model="flat">
  <worldbody>
    <body>
      <joint name="bend"/>
      <geom type="sphere" size="0.01"/>
      <site name="pad_a" type="box" size="0.01 0.01 0.001"/>
    </body>
  </worldbody>
</mujoco>
"""
YAML = """
hand: flat.xml
fingers: [[bend]]
palm: {center: [0, 0, 0], normal: [0, 1, 0], fingers: [0, 0, 2]}
"""


def test_the_built_in_description_names_the_hands_own_joints():
    description = load_grasp()
    description.check(description.load_hand())
    closing = description.ranks()
    assert len(closing) == 12
    assert [closing[f"index_{link}"] for link in ("proximal", "middle", "distal")] == [0, 1, 2]


def test_a_description_finds_its_hand_beside_itself(tmp_path):
    (tmp_path / "flat.xml").write_text(HAND)
    (tmp_path / "flat.yaml").write_text(YAML)
    description = load_grasp(tmp_path / "flat.yaml")
    assert description.load_hand().joint_names == ("bend",)
    description.check(description.load_hand())


def test_joints_that_the_hand_does_not_have_are_listed(tmp_path):
    (tmp_path / "flat.xml").write_text(HAND)
    (tmp_path / "flat.yaml").write_text(YAML.replace("[[bend]]", "[[bend, curl], [grip]]"))
    description = load_grasp(tmp_path / "flat.yaml")
    with pytest.raises(HandError, match="does not have: curl, grip; it has bend"):
        description.check(description.load_hand())


def test_a_joint_that_slides_cannot_close(tmp_path):
    (tmp_path / "flat.xml").write_text(HAND.replace('name="bend"', 'name="bend" type="slide"'))
    (tmp_path / "flat.yaml").write_text(YAML)
    description = load_grasp(tmp_path / "flat.yaml")
    with pytest.raises(HandError, match="of hand 'flat' slide: bend"):
        description.check(description.load_hand())


@pytest.mark.parametrize(
    ("old", "new"),
    [("fingers: [[bend]]", "finger: [[bend]]"), ("[0, 0, 0]", "[0, 0]"), ("{", "{{")],
)
def test_a_wrong_description_is_refused_in_one_line(tmp_path, old, new):
    (tmp_path / "flat.yaml").write_text(YAML.replace(old, new))
    with pytest.raises(HandError, match="flat.yaml") as caught:
        load_grasp(tmp_path / "flat.yaml")
    assert "\n" not in str(caught.value)


def test_an_unknown_description_lists_the_known_ones():
    with pytest.raises(HandError, match="'shadow': known are isyhand"):
        load_grasp("shadow")


def test_a_level_palm_faces_up_with_the_fingers_along_x():
    palm = Palm(center=(0, 0, 0), normal=(0, 1, 0), fingers=(0, 0.5, 2))
    R_wh = palm.level()
    np.testing.assert_allclose(R_wh @ R_wh.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R_wh) == pytest.approx(1.0)
    np.testing.assert_allclose(R_wh @ (0, 1, 0), (0, 0, 1), atol=1e-12)
    np.testing.assert_allclose(R_wh @ (0, 0, 1), (1, 0, 0), atol=1e-12)


def test_a_pads_file_is_relative_to_the_description(tmp_path):
    hand = load_hand("isyhand")
    (tmp_path / "hand.xml").write_text(hand.xml)
    box = hand.pad_boxes[0]
    body = hand.model.body(box.body).name
    (tmp_path / "pads.yaml").write_text(
        f"pads: [{{name: one, body: {body}, pos: [0.02, 0, 0.0105], normal: +z, size: [0.02, 0.015]}}]"
    )
    text = "hand: hand.xml\npads: pads.yaml\nfingers: [[index_proximal]]\n"
    palm = "palm: {center: [0, 0, 0], normal: [0, 0, 1], fingers: [1, 0, 0]}\n"
    (tmp_path / "grasp.yaml").write_text(text + palm)
    assert load_grasp(tmp_path / "grasp.yaml").load_hand().pad_names == ("one",)
