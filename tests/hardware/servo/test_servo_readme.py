# SPDX-License-Identifier: MIT
from __future__ import annotations

import re
from pathlib import Path

from hardware.servo.table import STATE

README = (Path(__file__).parents[3] / "hardware/README.md").read_text()


def test_the_example_runs():
    example = re.search(r"```python\n(.*?)```", README, re.DOTALL).group(1)
    names = {}
    exec(example, names)
    assert names["state"].positions.max() > 0.1
    assert not any(servo.torque for servo in names["line"].servos.values())


def test_the_bytes_of_a_cycle_are_as_stated():
    reading = 14 + 15 + 15 * (11 + STATE.size)
    writing = 14 + 15 * 5
    assert f"A cycle is {reading + writing} bytes" in README
