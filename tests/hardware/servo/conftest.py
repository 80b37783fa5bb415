# SPDX-License-Identifier: MIT
from __future__ import annotations

import pytest

from hardware.emulate.servos import ServoLineEmulator
from hardware.servo.description import load_description
from hardware.servo.hand import Hand


@pytest.fixture
def description():
    # A loaded test machine may pause for longer than a real hand's watchdog and cycle allow.
    relaxed = {"watchdog": 2.0, "patience": 0.1}
    return load_description("isyhand").model_copy(update=relaxed)


@pytest.fixture
def line(description):
    with ServoLineEmulator(joint.id for joint in description.joints) as emulator:
        yield emulator


@pytest.fixture
def hand(description, line):
    """A configured hand with torque on."""
    with Hand(description, line.path) as hand:
        hand.configure()
        hand.enable()
        yield hand
        line.faults.__init__()  # what a test broke must not hold up the way out
