# SPDX-License-Identifier: MIT
"""Joints, pads and servos go by name from the hand's file to the estimate, whatever the order there."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from pathlib import Path

import gtsam
import numpy as np
import pytest

from hardware.device import PadState
from hardware.emulate.servos import ServoLineEmulator
from hardware.live.devices import load_hand_and_grasp
from hardware.live.fingers import Fingers
from hardware.live.health import check_model
from hardware.servo.description import load_description
from hardware.servo.hand import Hand
from hardware.tactile.frame import FULL_SCALE
from hardware.tactile.pressure import ContactDetector, PadScale
from vtgtsam import EstimatorConfig, PoseEstimator, load_object
from vtgtsam.exceptions import ConfigError
from vtgtsam.live.clock import RunClock
from vtgtsam.live.fusion import Fusion
from vtgtsam.live.inputs import Inputs
from vtgtsam.live.recorder import Recorder

ROOT = Path(__file__).parents[3]
ISYHAND = load_description("isyhand")
TOUCHED = ("pad_index_distal", "pad_palm_inner_1", "pad_thumb_middle")
T_WH = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.1, -0.2, 0.3), np.array([0.0, 0.1, 0.4]))


def shuffled(description, seed):
    """The same hand with joints and inputs in another order."""
    order = random.Random(seed)
    joints, inputs = list(description.joints), list(description.pads.inputs)
    order.shuffle(joints)
    order.shuffle(inputs)
    pads = description.pads.model_copy(update={"inputs": tuple(inputs)})
    return description.model_copy(update={"joints": tuple(joints), "pads": pads})


def contacts(description, hand):
    """What the detector makes of a board whose readings fall where TOUCHED pads are."""
    inputs = description.pads.inputs
    pressed = np.array([bool(set(entry.pads) & set(TOUCHED)) for entry in inputs])
    ohm = np.array([entry.reference_ohm for entry in inputs])
    scale = PadScale(baseline=ohm, drop=0.3 * ohm)
    detector = ContactDetector(description.pads, scale, ohm, hand.pad_names)
    return detector.update(FULL_SCALE * np.where(pressed, 0.4, 0.5))


def first_estimate(description, can):
    """From servos that stand at other angles each, through driver, streams and estimator."""
    description = description.model_copy(update={"patience": 0.1})
    hand, grasp = load_hand_and_grasp(description)
    estimator = PoseEstimator(hand, can, EstimatorConfig.tuned())
    angles = {name: 0.02 + 0.04 * k for k, name in enumerate(sorted(description.joint_names))}
    with ServoLineEmulator(joint.id for joint in description.joints) as line:
        for joint in description.joints:
            line.plant.place(joint.id, joint.ticks(min(angles[joint.name], joint.limits[1])))
        time.sleep(0.1)
        clock = RunClock()
        inputs = Inputs(hand.joint_names, hand.pad_names, clock.now_ns, Recorder(None))
        with Hand(description, line.path) as device:
            fingers = Fingers(device, hand, grasp, inputs, clock)
            while inputs.count("joints") == 0 or device.state().ages.any():
                fingers._cycle()  # torque is off: it reads, and commands are refused
    instant = clock.now_ns()
    inputs.put_hand_pose(0, T_WH)
    inputs.put_joints(instant, hand.joint_names, fingers.joints.tolist())
    inputs.put_contacts(instant, hand.pad_names, contacts(description, hand).contacts.tolist())
    T_wo = T_WH * gtsam.Pose3(gtsam.Rot3.Rx(0.4), np.array([0.09, 0.05, 0.075]))
    inputs.put_vision(instant, T_wo)
    return Fusion(inputs, estimator, clock.now_ns).step()


def test_the_first_estimate_of_a_hand_in_another_order_is_that_of_the_ordered_one():
    can = load_object("can")
    expected = first_estimate(ISYHAND, can)
    assert np.count_nonzero(expected.pad_weights) > 0  # touch does count
    for seed in (1, 2):
        found = first_estimate(shuffled(ISYHAND, seed), can)
        np.testing.assert_allclose(found.T_wo.matrix(), expected.T_wo.matrix(), atol=1e-12)
        np.testing.assert_array_equal(found.pad_weights > 0, expected.pad_weights > 0)


def test_contacts_come_in_the_models_order():
    hand, _ = load_hand_and_grasp(ISYHAND)
    state = contacts(shuffled(ISYHAND, 3), hand)
    assert isinstance(state, PadState)
    both = {*TOUCHED, "pad_palm_inner_2"}  # on one input with its neighbour
    assert {n for n, on in zip(hand.pad_names, state.contacts, strict=True) if on} == both


def changed(**changes):
    content = ISYHAND.model_dump()
    content.update(changes)
    return type(ISYHAND).model_validate(content)


def joints(rename=None, drop=()):
    found = [
        {**j, "name": (rename or {}).get(j["name"], j["name"])}
        for j in ISYHAND.model_dump()["joints"]
    ]
    return [joint for joint in found if joint["name"] not in drop]


class TestCheckRefusesWhatRunWouldTripOver:
    def test_a_misspelt_joint_is_named_with_the_likely_one(self):
        description = changed(joints=joints(rename={"thumb_middle": "thumb_mid"}))
        (problem,) = check_model(description).problems
        assert "no joints of the model: thumb_mid (is it thumb_middle?)" in problem
        assert "joints of the model without a servo: thumb_middle" in problem
        with pytest.raises(ConfigError, match="thumb_mid"):
            load_hand_and_grasp(description)

    def test_a_joint_too_few_is_named(self):
        (problem,) = check_model(changed(joints=joints(drop=("ring_distal",)))).problems
        assert "without a servo: ring_distal" in problem

    def test_a_pad_on_no_input_is_named(self):
        pads = ISYHAND.model_dump()["pads"]
        pads["inputs"] = pads["inputs"][1:]
        (problem,) = check_model(changed(pads=pads)).problems
        assert "missing: pad_thumb_proximal" in problem

    def test_a_model_without_a_grasp_says_what_is_missing(self, tmp_path):
        model = tmp_path / "leap.xml"
        model.write_text("<mujoco/>")
        (problem,) = check_model(changed(hand=str(model))).problems
        assert "say so under `grasp`" in problem

    def test_a_hand_that_fits_says_so(self):
        finding = check_model(ISYHAND)
        assert finding.problems == []
        assert finding.facts == ["names the 15 joints and 16 pads of the model 'isyhand'"]

    def test_run_refuses_before_it_opens_any_port(self, tmp_path):
        path = tmp_path / "mine.yaml"
        text = (ROOT / "hardware/data/isyhand.yaml").read_text(encoding="utf-8")
        path.write_text(text.replace("thumb_middle, ", "thumb_mid, "), encoding="utf-8")
        done = subprocess.run(
            [sys.executable, "-m", "hardware", "run", "--object", "can", "--hand", str(path)]
            + ["--servos", "/dev/none", "--pads", "/dev/none", "--yes"],
            cwd=ROOT, capture_output=True, text=True, timeout=120,
        )  # fmt: skip
        assert done.returncode == 1
        assert "thumb_mid (is it thumb_middle?)" in done.stderr
        assert done.stderr.count("\n") == 1


def test_a_hand_without_pads_is_fused_from_vision_and_its_shape():
    from hardware.live.sensors import NoPads, Pads

    hand, _ = load_hand_and_grasp(changed(pads=None))
    clock = RunClock()
    inputs = Inputs(hand.joint_names, hand.pad_names, clock.now_ns, Recorder(None))
    device = NoPads(len(hand))
    assert "no pads" in device.prepare()
    pads = Pads(device, hand.pad_names, inputs, clock)
    for instant, state in device.since(clock.start - 1.0):
        pads._take(instant, state)
    assert not inputs.contacts_at(clock.now_ns()).any()
    assert device.since(time.monotonic()) == []  # 50 times a second, not more


def test_a_real_hands_wiring_needs_no_mujoco():
    code = (
        "import sys; sys.modules['mujoco'] = None\n"
        "import hardware.servo.hand, hardware.servo.survey, hardware.tactile.pressure, hardware.camera.wrist\n"
        "from hardware.servo.description import load_description, wiring_of\n"
        "wiring_of(load_description('isyhand'))\n"
        "import vtgtsam.grasp; vtgtsam.grasp.load_grasp()\n"
    )
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, timeout=60)
