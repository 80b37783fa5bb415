# SPDX-License-Identifier: MIT
"""What the live loop relies on, asked of every driver of a hand; a new one is added to ``DRIVERS``."""

from __future__ import annotations

import math
import threading
import time
from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pytest

from hardware.device import CommandError, HandDevice
from hardware.emulate.servos import ServoLineEmulator
from hardware.ros_hand import RosHand, RosHandError
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


class RosDriver:
    """Another program's driver of a hand: tells its joints 100 times a second, and goes to its goals under torque."""

    def __init__(self, names, intake):
        self.joints, self.torque = dict.fromkeys(names, 0.0), False
        self._intake, self._stop = intake, threading.Event()
        self._thread = threading.Thread(target=self._tell, daemon=True)
        self._thread.start()

    def _tell(self):
        while not self._stop.wait(0.005):
            sec, nanosec = divmod(time.time_ns(), 10**9)
            header = SimpleNamespace(stamp=SimpleNamespace(sec=sec, nanosec=nanosec))
            told = dict(reversed(self.joints.items()))  # in an order of its own
            self._intake(SimpleNamespace(header=header, name=[*told], position=[*told.values()]))

    def send(self, names, angles):
        if self.torque:
            self.joints |= dict(zip(names, angles, strict=True))

    def set_torque(self, on):
        self.torque = on
        return ""

    def close(self):
        self._stop.set()
        self._thread.join()


@contextmanager
def over_ros():
    """A hand behind a ROS driver, without ROS: its messages are plain objects."""
    drivers = []

    def open_link(intake):
        drivers.append(RosDriver(limits, intake))
        return drivers[-1]

    limits = {f"finger_{i}": (-0.3, 2.0) for i in range(4)}
    yield (
        lambda: RosHand(limits, open_link=open_link),
        lambda: any(driver.torque for driver in drivers),
    )


DRIVERS = {
    "a driver in ROS 2": over_ros,
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


def test_a_ros_driver_that_falls_silent_takes_the_torque_with_it():
    with over_ros() as (opened, driven), opened() as device:
        device.configure()
        device.enable()
        device._link.close()
        with pytest.raises(
            RosHandError, match=r"/joint_states has not told finger_0, .*has the driver died"
        ):
            for _ in range(100):
                device.state()
                time.sleep(0.02)
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
