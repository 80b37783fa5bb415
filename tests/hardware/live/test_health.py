# SPDX-License-Identifier: MIT
from hardware.live import health
from hardware.servo.description import load_description


def test_what_has_no_port_is_not_checked_rather_than_wrong():
    description = load_description("isyhand")
    servos, pads = health.check_servos(description, None), health.check_pads(description, None)
    assert servos.lines() == ["servos: not checked; give their port with --servos"]
    assert pads.lines() == ["pads: not checked; give the board's port with --pads"]
    assert not servos.ok and not pads.ok


def test_a_port_that_is_not_there_is_wrong_and_said_once():
    finding = health.check_pads(load_description("isyhand"), "/dev/none")
    assert finding.lines()[0] == "pads on /dev/none: wrong"
    (problem,) = finding.problems
    assert "on /dev/none: No such file or directory; check" in problem
    assert "Errno" not in problem
