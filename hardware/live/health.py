# SPDX-License-Identifier: MIT
"""What ``python -m hardware check`` looks at, without moving anything."""

from __future__ import annotations

import contextlib
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hardware.camera.camera import Camera, CameraError, open_camera
from hardware.camera.realsense import find_devices
from hardware.camera.wrist import load_wrist
from hardware.servo.bus import Bus, BusError, NoAnswerError, ServoError
from hardware.servo.description import HandDescription, Joint
from hardware.servo.hand import SLOWEST
from hardware.servo.port import latency_timer
from hardware.servo.safety import WARM
from hardware.servo.setup import describe_error, find_servos, wrong_models
from hardware.tactile.board import PadBoard, PadBoardError
from hardware.tactile.pressure import PadCalibrationError, load_scale, measure_baseline
from vtgtsam.exceptions import ConfigError, RecordingError, VtgtsamError

from .devices import load_hand_and_grasp

NEW = 1  # id of a servo as delivered
_ASKED = 6  # times, whether answers come whole
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


def check_model(description: HandDescription) -> Finding:
    """Whether the hand's file, its model and its grasp name the same joints and pads."""
    finding = Finding("hand's file")
    try:
        hand, _ = load_hand_and_grasp(description)
    except VtgtsamError as error:
        finding.problems.append(str(error))
    else:
        pads = "no pads" if description.pads is None else f"{len(hand)} pads"
        finding.facts.append(
            f"names the {len(description.joints)} joints and {pads} of the model {hand.name!r}"
        )
    return finding


def check_calibrations(description: HandDescription, scale: Path, wrist: Path) -> Finding:
    """Whether the calibrations are there that a run reads.

    Args:
        description: The built hand.
        scale: File of its pads' bench calibration.
        wrist: File of its pose in the camera frame.
    """
    finding = Finding("calibrations")
    try:
        if description.pads is not None:
            load_scale(scale, description.pads)
            finding.facts.append(f"pads: {scale}")
    except ConfigError as error:
        finding.problems.append(str(error))
    try:
        load_wrist(wrist)
        finding.facts.append(f"wrist: {wrist}")
    except ConfigError as error:
        finding.problems.append(str(error))
    return finding


def check_servos(description: HandDescription, path: str | None) -> Finding:
    """Whether all servos are there, well supplied, cool, and without errors."""
    finding = Finding(f"servos on {path}" if path else "servos")
    if path is None:
        finding.not_checked = "give their port with --servos"
        return finding
    if (cycle := description.cycle) > SLOWEST:
        finding.problems.append(_too_slow(description, description.baud, cycle))
    names = {joint.id: joint.name for joint in description.joints}
    try:
        with Bus(path, description.baud, names) as bus:
            there = _ping(bus, description, finding)
            for joint in there:
                _check_servo(bus, description, joint, finding)
        missing = [joint for joint in description.joints if joint not in there]
        if missing:
            finding.problems += _elsewhere(path, description, missing)
    except BusError as error:
        finding.problems.append(str(error))
    _check_timer(path, finding)
    return finding


def _ping(bus: Bus, description: HandDescription, finding: Finding) -> list[Joint]:
    """The joints whose servos answer."""
    models = {}
    for joint in description.joints:
        with contextlib.suppress(NoAnswerError):
            models[joint.id], _ = bus.ping(joint.id, attempts=2, patience=0.05)
    finding.facts.append(
        f"{len(models)} of {len(description.joints)} answer at {bus.baud} baud; a cycle takes "
        f"{1000 * description.cycle:.1f} ms on the line"
    )
    finding.problems += wrong_models(description, models)
    return [joint for joint in description.joints if joint.id in models]


def _check_servo(bus: Bus, description: HandDescription, joint: Joint, finding: Finding) -> None:
    if _two_talk(bus, joint.id):
        finding.problems.append(
            f"{joint.label} answers pings, but what it counts comes damaged: have two servos the id {joint.id}, or is "
            "its cable bad? Take servos off the line one by one, and give each its own id (Dynamixel Wizard)"
        )
        return
    volts = bus.read(joint.id, "present_input_voltage") / 10
    degrees = bus.read(joint.id, "present_temperature")
    low, high = description.model(joint).supply
    finding.facts.append(f"{joint.label}: {volts:.1f} V, {degrees} °C")
    if not low <= volts <= high:
        finding.problems.append(
            f"{joint.label} has {volts:.1f} V: it needs {low:g} to {high:g} V; check supply and cables"
        )
    if degrees >= WARM:
        finding.problems.append(f"{joint.label} is {degrees} °C warm: let it cool down")
    if bits := bus.read(joint.id, "hardware_error_status"):
        finding.problems.append(
            f"{describe_error(bus, joint.id, bits)}: find the cause, then `python -m hardware reboot --joint "
            f"{joint.name}`"
        )
    if bus.read(joint.id, "torque_enable"):
        finding.problems.append(
            f"{joint.label} has torque on: `python -m hardware off` takes it away"
        )


def _two_talk(bus: Bus, servo_id: int) -> bool:
    """Whether most answers come damaged whose bits differ between any two servos."""
    damaged = 0
    for _ in range(_ASKED):
        before = bus.traffic.damaged
        try:
            bus.read(servo_id, "realtime_tick", attempts=1, patience=0.05)
        except (NoAnswerError, ServoError):
            damaged += bus.traffic.damaged > before
    return damaged > _ASKED / 2


def _elsewhere(path: str, description: HandDescription, missing: list[Joint]) -> list[str]:
    """What to say of servos that do not answer: perhaps they do at another rate, or by another id."""
    everyone = len(missing) == len(description.joints)
    ids = [joint.id for joint in missing]
    new = [] if NEW in {joint.id for joint in description.joints} else [NEW]
    found = find_servos(path, [*(ids[:3] if everyone else ids), *new])
    at_id = {i: baud for baud, models in found.items() for i in models}
    if everyone and any(i in at_id for i in ids):
        baud = next(at_id[i] for i in ids if i in at_id)
        cycle = description.model_copy(update={"baud": baud}).cycle
        if cycle > SLOWEST:
            return [f"servos answer at {baud} baud: {_too_slow(description, baud, cycle)}"]
        return [
            f"servos answer at {baud} baud, not {description.baud}: write `baud: {baud}` in the hand's file"
        ]
    if everyone and not at_id:
        return ["no servo answers at any rate: is the hand's power on, and this its port?"]
    found_words = []
    for joint in missing:
        if joint.id in at_id:
            found_words.append(
                f"{joint.label} answers at {at_id[joint.id]} baud, the others at {description.baud}: set it to "
                f"{description.baud} (Dynamixel Wizard)"
            )
        else:
            found_words.append(f"{joint.label} does not answer: check cable and id")
    if NEW in new and NEW in at_id:
        found_words.append(
            f"a servo with id {NEW}, as delivered, answers at {at_id[NEW]} baud and is in no line of the hand's file: "
            "is it one of those missing? Give it id and rate (Dynamixel Wizard)"
        )
    return found_words


def _too_slow(description: HandDescription, baud: int, cycle: float) -> str:
    return (
        f"at {baud} baud a cycle of {len(description.joints)} servos takes {1000 * cycle:.0f} ms, the loop has "
        f"{1000 * SLOWEST:.0f}: set the servos to 1000000 baud or more (Dynamixel Wizard), and `baud` in the hand's "
        "file as well"
    )


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
    if wiring is None:
        finding.facts.append(
            "the hand's file names none: a run goes on vision and the hand's shape"
        )
        return finding
    if port is None:
        finding.not_checked = "give the board's port with --pads"
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
            seen, with_infrared = _count_images(camera)
            rate = seen / (time.monotonic() - start)
            stereo = camera.left is not None
    except (CameraError, RecordingError) as error:
        finding.problems.append(str(error))
        return finding
    finding.facts.append(f"{rate:.0f} images a second")
    finding.facts.append(
        f"infrared images beside {with_infrared} of {seen}: the tracker depth-hand finds the object's outline there"
        if stereo
        else "no infrared images: the tracker goes by depth aligned to colour"
    )
    if rate < _IMAGE_RATE:
        finding.problems.append(f"only {rate:.0f} images a second: is it on a USB 3 port?")
    return finding


def _count_images(camera: Camera) -> tuple[int, int]:
    """How many of the next images come, and how many of them with an infrared image."""
    seen = with_infrared = 0
    for _ in range(_IMAGES):
        frame = camera.read()
        seen += frame is not None
        left = None if frame is None else frame.left
        with_infrared += left is not None and left.infrared is not None
    return seen, with_infrared
