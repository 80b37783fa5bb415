# SPDX-License-Identifier: MIT
from __future__ import annotations

from hardware.servo.replies import Traffic


def link(good, lost=0, damaged=0):
    statistics = Traffic()
    for k in range(good + lost):
        statistics.count(13, answered=k < good, now=float(k))
    statistics.damaged = damaged
    return statistics


def test_a_good_line_needs_no_word():
    assert link(good=1000, lost=5).diagnosis() == ""
    assert Traffic().diagnosis() == ""


def test_a_bad_line_names_the_servo_and_its_share():
    assert (
        link(90, 10)
        .diagnosis(lambda i: f"J{i}")
        .startswith("answers lost (no packets at all): J13 10 %")
    )
    assert "damaged packets" in link(90, 10, damaged=10).diagnosis()


def test_silence_is_told_from_noise():
    assert "nothing comes back" in link(0, 5).diagnosis()
    assert "only noise" in link(0, 5, damaged=3).diagnosis()


def test_the_last_answer_is_remembered():
    assert link(good=3, lost=4).last_answer[13] == 2.0
