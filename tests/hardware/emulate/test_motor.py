# SPDX-License-Identifier: MIT
from __future__ import annotations

import pytest

from hardware.emulate.motor import JointMotion, JointPlant
from hardware.emulate.servos import ServoLineEmulator
from hardware.servo.description import load_description
from hardware.servo.hand import Hand


class Obedient:
    """Joints that are at once where they are told, with currents and speeds that tell them apart."""

    def __init__(self, names):
        self.at = {name: 0.01 * k for k, name in enumerate(names)}
        self.drives = {}

    def advance(self, dt, drives):
        self.drives = dict(drives)
        self.at |= {name: drive.goal for name, drive in drives.items() if drive.torque}
        return {name: JointMotion(angle, 0.5, 0.1) for name, angle in self.at.items()}


def test_a_simulated_hand_moves_as_the_servos_are_told_and_is_read_back():
    relaxed = {"watchdog": 2.0, "patience": 0.1}  # for busy test machines
    description = load_description("isyhand").model_copy(update=relaxed)
    simulated = Obedient(description.joint_names)
    plant = JointPlant(description.joints, simulated)
    with ServoLineEmulator((joint.id for joint in description.joints), plant=plant) as line:
        with Hand(description, line.path) as hand:
            hand.configure()
            hand.enable()
            hand.state()
            hand.command({"index_proximal": 0.3, "palm_inner": -0.2})
            for _ in range(4):
                state = hand.state()
    angles = dict(zip(state.joint_names, state.positions, strict=True))
    tick = 0.0016  # [rad], a bit more than one
    assert angles["index_proximal"] == pytest.approx(0.3, abs=tick)
    assert angles["palm_inner"] == pytest.approx(-0.2, abs=tick)
    assert angles["ring_distal"] == pytest.approx(0.14, abs=tick)  # told to stay
    assert state.velocities == pytest.approx([0.5] * 15, abs=0.03)
    assert state.currents == pytest.approx([0.1] * 15)
    drive = simulated.drives["index_proximal"]
    assert drive.current_cap == pytest.approx(0.3)
    assert drive.speed == pytest.approx(5.5, abs=0.03)
