# SPDX-License-Identifier: MIT
"""What the live loop relies on, asked of every driver of a hand; a new one is added to ``DRIVERS``."""

from __future__ import annotations

import math
import time
from contextlib import contextmanager

import numpy as np
import pytest

from hardware.device import CommandError, HandDevice
from hardware.emulate.servos import ServoLineEmulator
from hardware.servo.description import HandDescription, load_description
from hardware.servo.hand import Hand
from vtgtsam.exceptions import VtgtsamError

GAINS = {"P": 600, "I": 0, "D": 200}
LEAP_LIKE = HandDescription.model_validate(
    {
        "hand": "leap.xml",
        "servo": "XC330-M288-T",
        "baud": 4_000_000,
        "watchdog": 2.0,
        "patience": 0.1,
        "joints": [
            {"name": f"finger_{i}", "id": i, "sign": 1, "zero": 100 * i, "limits": (-0.3, 2.0)}
            | {"gains": GAINS, "current": 0.5}
            for i in range(16)
        ],
    }
)
ISYHAND = load_description("isyhand").model_copy(update={"watchdog": 2.0, "patience": 0.1})


@contextmanager
def dynamixels(description):
    """A hand on an emulated line, and what tells whether any motor is driven."""
    ids = [joint.id for joint in description.joints]
    with ServoLineEmulator(ids, description.baud, model=description.servo) as line:
        for joint in description.joints:
            line.plant.place(joint.id, joint.ticks(0.0))
        time.sleep(0.05)
        yield (
            lambda: Hand(description, line.path),
            lambda: any(s.torque for s in line.servos.values()),
        )


DRIVERS = {
    "XL330s of the ISyHand": lambda: dynamixels(ISYHAND),
    "XC330s in the manner of a LEAP hand": lambda: dynamixels(LEAP_LIKE),
}


@pytest.fixture(params=DRIVERS)
def driver(request):
    with DRIVERS[request.param]() as (opened, driven):
        yield opened, driven


def settled(device, **goals):
    """The state after the joints went to these angles by steps of at most 0.2 rad."""
    for _ in range(60):
        here = device.state().angles
        device.command({n: here[n] + np.clip(a - here[n], -0.2, 0.2) for n, a in goals.items()})
        time.sleep(0.005)
    return device.state()


def test_it_keeps_the_contract(driver):
    opened, driven = driver
    with opened() as device:
        assert isinstance(device, HandDevice)
        name, other = device.joint_names[2], device.joint_names[0]
        assert set(device.limits) == set(device.joint_names)
        assert not device.enabled and not driven()
        with pytest.raises(CommandError):
            device.command({name: 0.0})  # no torque
        device.configure()
        device.enable()
        assert device.enabled and driven()

        state = settled(device, **{name: 0.6})
        assert state.joint_names == device.joint_names
        assert state.positions.shape == (len(device.joint_names),)
        assert state.angles[name] == pytest.approx(0.6, abs=0.02)
        assert state.angles[other] == pytest.approx(0.0, abs=0.02)  # nobody told it to move
        assert abs(state.time - time.monotonic()) < 1.0

        for wrong in ({name: math.nan}, {name: 9.0}, {"nobody": 0.0}, {name: 0.6, other: 1.9}):
            device.state()
            with pytest.raises(CommandError):
                device.command(wrong)
        assert device.state().angles[name] == pytest.approx(0.6, abs=0.02)  # refused as a whole

        device.enable()  # again: it stays where it is
        assert settled(device).angles[name] == pytest.approx(0.6, abs=0.02)
        device.off()
        assert not device.enabled and not driven()
        device.enable()
        assert isinstance(device.remarks(), list)
    assert not driven()


def test_torque_goes_off_whatever_ends_the_block(driver):
    opened, driven = driver
    with pytest.raises(ZeroDivisionError), opened() as device:
        device.configure()
        device.enable()
        assert driven()
        raise ZeroDivisionError
    assert not driven()


class Stuck(HandDevice):
    """A hand whose torque cannot be confirmed off."""

    joint_names, limits, enabled = (), {}, False

    def configure(self): ...
    def enable(self): ...
    def state(self): ...
    def command(self, angles): ...
    def off(self): ...

    def close(self):
        raise VtgtsamError("torque not confirmed off: cut the power!")


def test_the_cause_is_told_before_the_torque_that_may_still_be_on():
    with pytest.raises(VtgtsamError, match=r"^a finger burns; torque not confirmed off"), Stuck():
        raise ValueError("a finger burns")
    with pytest.raises(VtgtsamError, match=r"^torque not confirmed off"), Stuck():
        pass
