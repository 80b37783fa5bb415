# SPDX-License-Identifier: MIT
"""Zeros that recorded grasps have measured, written into a hand's file."""

from __future__ import annotations

import numpy as np
import pytest

from hardware.commands.joints import calibrate_joints
from hardware.servo.description import DATA, load_description
from hardware.servo.survey import JointCalibrationError
from vtgtsam import Calibration
from vtgtsam.calibration.robot import Robot

HAND = load_description("isyhand")


def calibration(path, offsets, hand="isyhand"):
    """A calibration file with these joints' offsets [rad]; in an order of its own."""
    names = tuple(offsets)
    size = 6 + len(names)
    Calibration(
        robot=Robot(hand, names),
        camera=np.zeros(6),
        camera_origin=np.zeros(3),
        joint_zeros=offsets,
        covariance=np.diag(np.full(size, np.deg2rad(0.1) ** 2)),
    ).to_yaml(path)
    return path


@pytest.fixture
def offsets():
    names = sorted(HAND.joint_names)
    return {name: 0.01 * (k - 7) for k, name in enumerate(names)}


def test_each_joint_then_reads_less_by_what_it_read_too_much(tmp_path, offsets, capsys):
    mine = tmp_path / "mine.yaml"
    calibrate_joints(calibration=calibration(tmp_path / "calibration.yaml", offsets), out=mine)
    for before, after in zip(HAND.joints, load_description(mine).joints, strict=True):
        read_less = before.angle(2100) - after.angle(2100)
        assert read_less == pytest.approx(offsets[before.name], abs=np.pi / 4096 + 1e-9)
        assert (after.name, after.id, after.sign) == (before.name, before.id, before.sign)
    out = capsys.readouterr().out
    assert "thumb_rotation: zero 2048 -> " in out and "degrees too much (within 0.20)" in out
    assert f"15 joints written to {mine}" in out


def test_only_the_joints_that_are_named_change(tmp_path, offsets):
    mine = tmp_path / "mine.yaml"
    path = calibration(tmp_path / "calibration.yaml", offsets)
    calibrate_joints(calibration=path, out=mine, joint=["thumb_distal"])
    text, before = mine.read_text(), (DATA / "isyhand.yaml").read_text()
    changed = [a for a, b in zip(text.split("\n"), before.split("\n"), strict=True) if a != b]
    assert len(changed) == 1 and "thumb_distal" in changed[0]


def test_the_calibration_of_another_hand_is_refused_and_nothing_written(tmp_path):
    path, mine = tmp_path / "calibration.yaml", tmp_path / "mine.yaml"
    calibration(path, {"left": 0.0, "right": 0.1}, hand="gripper")
    with pytest.raises(JointCalibrationError, match="the hand's file has no joints left, right"):
        calibrate_joints(calibration=path, out=mine)
    assert not mine.exists()
