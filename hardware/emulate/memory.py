# SPDX-License-Identifier: MIT
"""An XL330-M288-T's control table and the rules of reading and writing it.

The rules follow the e-manual (see ``hardware.servo.table``): EEPROM locked under torque, read-only
registers, ranges and limits, gains and caps reset by a change of the operating mode, goals locked
after the Bus Watchdog has tripped. Where the manual is silent the choice is marked "assumed".
"""

from __future__ import annotations

from hardware.servo.codec import decode
from hardware.servo.table import ALERT, BAUD_CODES, MODEL, XL330, Register

FIRMWARE = 52

FAILED, RANGE, LENGTH, LIMIT, ACCESS = 1, 4, 5, 6, 7  # numbers in the error byte

_SIZE = 228  # [bytes]
_MODE_P_GAIN = 800  # assumed: P after a change of mode; not what a client would write, so it shows
_POSITION_MODE = 3
_TORQUE_ON_BY_GOAL = 8  # bit of drive_mode
_GOALS = ("goal_pwm", "goal_current", "goal_velocity", "goal_position")
_AT = {entry.address: (name, entry) for name, entry in XL330.items()}


class ServoMemory:
    """The control table of one servo.

    Attributes:
        eeprom_writes: How often a register that wears out was written.
    """

    def __init__(self, servo_id: int, baud: int) -> None:
        self.eeprom_writes = 0
        self._memory = bytearray(_SIZE)
        for name, entry in XL330.items():
            self.set(name, entry.initial)
        self.set("model_number", MODEL)
        self.set("firmware_version", FIRMWARE)
        self.set("id", servo_id)
        self.set("baud_rate", BAUD_CODES[baud])

    def get(self, name: str) -> int:
        """Count in a register."""
        entry = XL330[name]
        return decode(name, bytes(self._memory[entry.address : entry.address + entry.size]))

    def set(self, name: str, count: int) -> None:
        """Put a count into a register, past all rules."""
        entry = XL330[name]
        data = count.to_bytes(entry.size, "little", signed=entry.signed)
        self._memory[entry.address : entry.address + entry.size] = data

    @property
    def servo_id(self) -> int:
        """The id it answers to."""
        return self.get("id")

    @property
    def baud(self) -> int:
        """The rate it listens at."""
        return next(b for b, code in BAUD_CODES.items() if code == self.get("baud_rate"))

    @property
    def torque(self) -> bool:
        """Whether the motor is driven."""
        return bool(self.get("torque_enable"))

    @property
    def tripped(self) -> bool:
        """Whether the Bus Watchdog has stopped it."""
        return self.get("bus_watchdog") == -1

    @property
    def alert(self) -> int:
        """The alert bit of its error bytes."""
        return ALERT if self.get("hardware_error_status") else 0

    def read(self, address: int, length: int) -> tuple[int, bytes]:
        """Error number and bytes. Gaps between registers read as zero (assumed)."""
        if length == 0 or address + length > _SIZE:
            return ACCESS, b""
        return 0, bytes(self._memory[address : address + length])

    def write(self, address: int, data: bytes) -> int:
        """Error number. Data for several registers is written as a whole or not at all."""
        pieces = []
        while data:
            if address not in _AT:
                return ACCESS
            name, entry = _AT[address]
            if len(data) < entry.size:
                return LENGTH
            count = decode(name, data[: entry.size])
            if error := self._refuses(name, entry, count):
                return error
            pieces.append((name, count))
            address, data = address + entry.size, data[entry.size :]
        for name, count in pieces:
            self._write(name, count)
        return 0 if pieces else LENGTH

    def reset_ram(self) -> None:
        """RAM as after power on; EEPROM stays."""
        for name, entry in XL330.items():
            if not entry.eeprom and entry.writable:
                self.set(name, entry.initial)
        self._reset_for_mode()
        self.set("hardware_error_status", 0)
        self.set("registered_instruction", 0)

    def _refuses(self, name: str, entry: Register, count: int) -> int:
        """Error number of a write that is not allowed now, else 0."""
        if not entry.writable or (entry.eeprom and self.torque):
            return ACCESS
        if not entry.low <= count <= entry.high or (name in _GOALS and self.tripped):
            return RANGE
        if name == "goal_current" and abs(count) > self.get("current_limit"):
            return LIMIT
        if name == "goal_position" and self.get("operating_mode") == _POSITION_MODE:
            low, high = self.get("min_position_limit"), self.get("max_position_limit")
            return 0 if low <= count <= high else LIMIT
        if name == "torque_enable" and count and self.alert:
            return FAILED  # assumed: the manual says only that a reboot is needed
        return 0

    def _write(self, name: str, count: int) -> None:
        """Put an allowed count and what follows from it."""
        before = self.get(name)
        self.set(name, count)
        self.eeprom_writes += XL330[name].eeprom
        if name == "operating_mode" and count != before:
            self._reset_for_mode()
            self.set("position_p_gain", _MODE_P_GAIN)
        elif name == "goal_position" and self.get("drive_mode") & _TORQUE_ON_BY_GOAL:
            self.set("torque_enable", int(not self.alert))

    def _reset_for_mode(self) -> None:
        for name in ("position_d_gain", "position_i_gain", "position_p_gain"):
            self.set(name, XL330[name].initial)
        self.set("profile_velocity", 0)
        self.set("profile_acceleration", 0)
        self.set("goal_pwm", self.get("pwm_limit"))
        self.set("goal_current", self.get("current_limit"))
