# SPDX-License-Identifier: MIT
from __future__ import annotations

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from hardware.servo.description import DATA, HandDescription, Joint, load_description
from vtgtsam.exceptions import ConfigError

GAINS = {"P": 400, "I": 0, "D": 400}
JOINT = {"name": "j", "id": 1, "sign": 1, "zero": 2048, "limits": [-1, 1], "gains": GAINS}


def load(tmp_path, **changes):
    content = {"hand": "isyhand", "baud": 1000000, "joints": [JOINT], **changes}
    path = tmp_path / "hand.yaml"
    path.write_text(yaml.safe_dump(content))
    return load_description(path)


def test_a_file_needs_little(tmp_path):
    hand = load(tmp_path)
    assert hand.joints[0].current == 0.3  # the cautious default [A]
    assert hand.watchdog == 0.2


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"baud": 12345}, "baud must be one of 9600, .* got 12345"),
        ({"watchdog": 0}, "watchdog: .*got 0"),
        ({"joints": []}, "joints: .*at least 1"),
        ({"joints": [JOINT, JOINT]}, "its own name; given twice: .*j"),
        ({"joints": [JOINT, {**JOINT, "name": "k"}]}, r"its own id; given twice: \[1\]"),
        ({"joints": [{**JOINT, "sign": 2}]}, "joints.0.sign: .*got 2"),
        ({"joints": [{**JOINT, "id": 253}]}, "joints.0.id: .*got 253"),
        ({"joints": [{**JOINT, "limits": [1, -1]}]}, "limits must be .least, largest."),
        ({"joints": [{**JOINT, "limits": [-90, 90]}]}, r"within a turn \[rad\], got -90"),
        (
            {"joints": [{**JOINT, "current": 300}]},
            "current must be at most 1.75 A for an XL330-M288-T, got 300",
        ),
        ({"joints": [{**JOINT, "gain": 3}]}, "joints.0.gain: Extra"),
        ({"joints": [{**JOINT, "gains": {"P": 400, "I": 0}}]}, "joints.0.gains.D: .*required"),
        ({"boud": 3}, "boud: Extra"),
    ],
)
def test_a_mistake_is_named_with_its_place(tmp_path, changes, message):
    with pytest.raises(ConfigError, match=message) as caught:
        load(tmp_path, **changes)
    assert "hand.yaml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_unknown_hand_lists_the_known_ones():
    with pytest.raises(ConfigError, match="no hand 'leap'.*isyhand"):
        load_description("leap")


def test_a_file_that_is_no_yaml_says_so(tmp_path):
    path = tmp_path / "hand.yaml"
    path.write_text("joints: [")
    with pytest.raises(ConfigError, match="hand.yaml is not valid YAML"):
        load_description(path)


def test_the_shipped_files_can_be_read():
    assert list(DATA.glob("*.yaml"))
    for path in DATA.glob("*.yaml"):
        assert isinstance(load_description(path), HandDescription)


@given(
    st.sampled_from([1, -1]),
    st.integers(0, 4095),
    st.floats(-3.1, 3.1),
)
def test_angles_survive_the_way_to_ticks_and_back(sign, zero, angle):
    joint = Joint(**{**JOINT, "sign": sign, "zero": zero})
    half_a_tick = 0.000767  # [rad]
    assert joint.angle(joint.ticks(angle)) == pytest.approx(angle, abs=half_a_tick)
    assert (joint.ticks(angle) - zero) * sign * angle >= 0
