# SPDX-License-Identifier: MIT
"""What ``python -m hardware check`` looks at, without moving anything."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np

from hardware.camera.camera import CameraError, open_camera
from hardware.camera.realsense import find_devices
from hardware.servo.bus import Bus, BusError, NoAnswerError
from hardware.servo.description import HandDescription
from hardware.servo.port import latency_timer
from hardware.servo.safety import WARM
from hardware.servo.setup import describe_error, find_servos
from hardware.servo.table import MODEL
from hardware.tactile.board import PadBoard, PadBoardError
from hardware.tactile.pressure import PadCalibrationError, measure_baseline
from vtgtsam.exceptions import RecordingError

SUPPLY = 4.5, 5.5  # [V]; the XL330 runs from 3.7 to 6 V, 5 V recommended
_SLOW_TIMER = 0.002  # [s]
_PAD_RATE = 45.0  # [Hz], fewer readings than this are too few for the loop
_IMAGES, _IMAGE_RATE = 30, 25.0  # [Hz]


@dataclass
class Finding:
    """What was found on one device.

    Attributes:
        device: Its name.
        facts: What is so.
        problems: What is wrong, each with what to do.
        not_checked: What to do so that it is looked at; empty where it was.
    """

    device: str
    facts: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    not_checked: str = ""

    @property
    def ok(self) -> bool:
        """Whether the device was looked at and nothing is wrong."""
        return not (self.problems or self.not_checked)

    def lines(self) -> list[str]:
        """For people."""
        if self.not_checked:
            return [f"{self.device}: not checked; {self.not_checked}"]
        verdict = "wrong" if self.problems else "ok"
        return [
            f"{self.device}: {verdict}",
            *(f"  {fact}" for fact in self.facts),
            *(f"  PROBLEM: {problem}" for problem in self.problems),
        ]


def check_ports(ports: list[str]) -> Finding:
    """The serial ports there are."""
    finding = Finding("serial ports", list(ports))
    if not ports:
        finding.problems.append("none: plug in the servos' adapter and the pad board")
    return finding


def check_servos(description: HandDescription, path: str | None) -> Finding:
    """Whether all servos are there, well supplied, cool, and without errors."""
    finding = Finding(f"servos on {path}" if path else "servos")
    if path is None:
        finding.not_checked = "give their port with --servos"
        return finding
    names = {joint.id: joint.name for joint in description.joints}
    try:
        with Bus(path, description.baud, names) as bus:
            there = _ping(bus, names, finding)
            for servo_id in there:
                _check_servo(bus, servo_id, finding)
        if not there:
            finding.problems[:] = [_elsewhere(path, description)]
    except BusError as error:
        finding.problems.append(str(error))
    _check_timer(path, finding)
    return finding


def _ping(bus: Bus, names: dict[int, str], finding: Finding) -> list[int]:
    """Ids that answer."""
    models = {}
    for servo_id in names:
        try:
            models[servo_id], _ = bus.ping(servo_id, attempts=2, patience=0.05)
        except NoAnswerError:
            finding.problems.append(f"{bus.label(servo_id)} does not answer: check cable and id")
    finding.facts.append(f"{len(models)} of {len(names)} answer at {bus.baud} baud")
    for servo_id, model in models.items():
        if model != MODEL:
            finding.problems.append(
                f"{bus.label(servo_id)} is model {model}, an XL330-M288-T is {MODEL}: wrong id?"
            )
    return list(models)


def _check_servo(bus: Bus, servo_id: int, finding: Finding) -> None:
    volts = bus.read(servo_id, "present_input_voltage") / 10
    degrees = bus.read(servo_id, "present_temperature")
    label = bus.label(servo_id)
    finding.facts.append(f"{label}: {volts:.1f} V, {degrees} °C")
    if not SUPPLY[0] <= volts <= SUPPLY[1]:
        finding.problems.append(f"{label} has {volts:.1f} V: it needs 5 V; check the supply")
    if degrees >= WARM:
        finding.problems.append(f"{label} is {degrees} °C warm: let it cool down")
    if bits := bus.read(servo_id, "hardware_error_status"):
        finding.problems.append(
            f"{describe_error(bus, servo_id, bits)}: find the cause, then switch its power off and on"
        )


def _elsewhere(path: str, description: HandDescription) -> str:
    """No servo answers: perhaps at another rate."""
    found = find_servos(path, [joint.id for joint in description.joints[:3]])
    if found:
        rates = ", ".join(map(str, found))
        return f"servos answer at {rates} baud, not {description.baud}: correct the hand's file"
    return "no servo answers at any rate: is the hand's power on, and this its port?"


def _check_timer(path: str, finding: Finding) -> None:
    held = latency_timer(path)
    if held is not None and held > _SLOW_TIMER:
        finding.problems.append(
            f"the adapter keeps bytes back for {1000 * held:.0f} ms: as root, echo 1 > "
            "/sys/bus/usb-serial/devices/<its ttyUSB name>/latency_timer"
        )


def check_pads(description: HandDescription, port: str | None) -> Finding:
    """Whether the pad board sends, fast enough, and the pads rest."""
    finding = Finding(f"pads on {port}" if port else "pads")
    wiring = description.pads
    if wiring is None or port is None:
        what = (
            "the board's port with --pads"
            if wiring is not None
            else "an entry 'pads' in the hand's file"
        )
        finding.not_checked = f"give {what}"
        return finding
    try:
        with PadBoard(port, inputs=len(wiring.inputs)) as board:
            board.wait()
            readings = board.record(2.0)
            counts = board.counts()
    except PadBoardError as error:
        finding.problems.append(str(error))
        return finding
    rate = len(readings) / 2.0
    finding.facts.append(f"{rate:.0f} readings a second, {counts.lost} lost")
    if rate < _PAD_RATE:
        finding.problems.append(
            counts.diagnosis() or f"only {rate:.0f} readings a second: is the computer busy?"
        )
    resistances = wiring.resistance(readings)
    for index, ohm in enumerate(np.median(resistances, axis=0)):
        finding.facts.append(f"{wiring.label(index)}: {ohm:.0f} ohm")
    try:
        measure_baseline(resistances, wiring)
    except PadCalibrationError as error:
        finding.problems.append(str(error))
    return finding


def check_camera(source: str) -> Finding:
    """Whether the camera streams."""
    finding = Finding(f"camera {source}")
    try:
        if source.startswith("realsense"):
            finding.facts += [
                f"{device.name} {device.serial}, firmware {device.firmware}, USB {device.usb}"
                for device in find_devices()
            ]
        with open_camera(source) as camera:
            camera.read()
            start = time.monotonic()
            seen = sum(camera.read() is not None for _ in range(_IMAGES))
            rate = seen / (time.monotonic() - start)
    except (CameraError, RecordingError) as error:
        finding.problems.append(str(error))
        return finding
    finding.facts.append(f"{rate:.0f} images a second")
    if rate < _IMAGE_RATE:
        finding.problems.append(f"only {rate:.0f} images a second: is it on a USB 3 port?")
    return finding
