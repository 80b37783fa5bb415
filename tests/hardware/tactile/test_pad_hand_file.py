# SPDX-License-Identifier: MIT
"""The pads and the wrist tag in the file of the built-in hand."""

import numpy as np
import pytest
import yaml

from hardware.servo.description import DATA, load_description
from vtgtsam import load_hand
from vtgtsam.exceptions import ConfigError


@pytest.fixture(scope="module")
def description():
    return load_description("isyhand")


def test_the_inputs_are_the_pads_of_the_hand_s_model(description):
    hand = load_hand(description.hand)
    inputs = description.pads.input_of(hand.pad_names)
    assert sorted(set(inputs)) == list(range(14))  # 16 pads, two palm links with two each
    assert [entry.pads for entry in description.pads.inputs if len(entry.pads) > 1] == [
        ("pad_palm_inner_1", "pad_palm_inner_2"),
        ("pad_palm_outer_1", "pad_palm_outer_2"),
    ]


def test_contact_is_the_paper_s_plain_threshold(description):
    assert description.pads.threshold == 0.15 and description.pads.release is None


def test_the_wrist_tag_lies_flat_behind_the_palm_and_is_upright_from_there(description):
    R_ht = description.wrist_tag.pose.rotation().matrix()
    np.testing.assert_allclose(R_ht[:, 2], [0, 0, -1], atol=1e-6)  # into the print: down
    np.testing.assert_allclose(R_ht[:, 1], [-1, 0, 0], atol=1e-6)  # down the print: to the viewer
    assert description.wrist_tag.pose.x() < -0.012  # behind the heel of the hand


def test_a_slip_in_the_pads_of_a_hand_s_file_is_told_with_its_place(tmp_path):
    content = yaml.safe_load((DATA / "isyhand.yaml").read_text())
    content["pads"]["inputs"][3]["reference_ohm"] = -1
    path = tmp_path / "hand.yaml"
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(ConfigError, match=r"pads\.inputs\.3\.reference_ohm: .*greater than 0.*-1"):
        load_description(path)
