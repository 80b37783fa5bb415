# SPDX-License-Identifier: MIT
"""One X330 servo as time goes by: clock, Bus Watchdog, heat, overload, reboot.

Only the position modes (3, 4, 5) move a motor. Not there: indirect registers, feedforward, the
acceleration of a profile.
"""

from __future__ import annotations

from hardware.servo.table import (
    ALERT,
    BAUD_CODES,
    CURRENT_BASED_POSITION,
    MODELS,
    TICKS_PER_TURN,
    X330,
    Register,
    decode,
)

from .motor import Drive, Motion

BOOT_TIME = 0.3  # [s], silence after a reboot (assumed)
OVERHEATING, OVERLOAD = 1 << 2, 1 << 5  # bits of hardware_error_status

_TICK = X330["goal_position"].scale  # [rad]
_FREE_SPEED = 7030.0  # [ticks/s], 103 rpm
_OVERLOAD_CURRENT = 800.0  # [mA], held for _OVERLOAD_TIME (assumed)
_OVERLOAD_TIME = 1.0  # [s] (assumed)
_AMBIENT = 28.0  # [degrees Celsius]
_HEATING = 40.0  # [K / A^2], in the end (assumed)
_COOLING_TIME = 60.0  # [s] (assumed)


FIRMWARE = 52

FAILED, RANGE, LENGTH, LIMIT, ACCESS = 1, 4, 5, 6, 7  # numbers in the error byte

_SIZE = 228  # [bytes]
_MODE_P_GAIN = 800  # assumed: P after a change of mode; not what a client would write, so it shows
_POSITION_MODE = 3
_TORQUE_ON_BY_GOAL = 8  # bit of drive_mode
_GOALS = ("goal_pwm", "goal_current", "goal_velocity", "goal_position")
_AT = {entry.address: (name, entry) for name, entry in X330.items()}


class ServoMemory:
    """The control table of one servo, and the rules of reading and writing it.

    The rules follow the e-manual (see ``hardware.servo.table``): EEPROM locked under torque, read-only
    registers, ranges and limits, gains and caps reset by a change of the operating mode, goals locked
    after the Bus Watchdog has tripped. Where the manual is silent the choice is marked "assumed".

    Attributes:
        eeprom_writes: How often a register that wears out was written.
    """

    def __init__(self, servo_id: int, baud: int, model: str = "XL330-M288-T") -> None:
        self.eeprom_writes = 0
        self._memory = bytearray(_SIZE)
        for name, entry in X330.items():
            self.set(name, entry.initial)
        self.set("model_number", MODELS[model].number)
        for name in ("current_limit", "goal_current"):
            self.set(name, MODELS[model].largest_current)
        self.set("firmware_version", FIRMWARE)
        self.set("id", servo_id)
        self.set("baud_rate", BAUD_CODES[baud])

    def get(self, name: str) -> int:
        """Count in a register."""
        entry = X330[name]
        return decode(name, bytes(self._memory[entry.address : entry.address + entry.size]))

    def set(self, name: str, count: int) -> None:
        """Put a count into a register, past all rules."""
        entry = X330[name]
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
        for name, entry in X330.items():
            if not entry.eeprom and entry.writable:
                self.set(name, entry.initial)
        self._reset_for_mode()
        self.set("hardware_error_status", 0)

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
        self.eeprom_writes += X330[name].eeprom
        if name == "operating_mode" and count != before:
            self._reset_for_mode()
            self.set("position_p_gain", _MODE_P_GAIN)
        elif name == "goal_position" and self.get("drive_mode") & _TORQUE_ON_BY_GOAL:
            self.set("torque_enable", int(not self.alert))

    def _reset_for_mode(self) -> None:
        for name in ("position_d_gain", "position_i_gain", "position_p_gain"):
            self.set(name, X330[name].initial)
        self.set("profile_velocity", 0)
        self.set("profile_acceleration", 0)
        self.set("goal_pwm", self.get("pwm_limit"))
        self.set("goal_current", self.get("current_limit"))


class EmulatedServo(ServoMemory):
    """A servo without its line.

    Attributes:
        temperature: Of its motor [degrees Celsius].
        turns: Whole turns of its motor when it was switched on, of which it knows nothing; None until it looks.
        stuck: Whether its encoder stays where it is. The position loop then pulls by the error it still reads.
    """

    def __init__(self, servo_id: int, baud: int = 57600, model: str = "XL330-M288-T") -> None:
        super().__init__(servo_id, baud, model)
        self.turns: int | None = None
        self.stuck = False
        self._unread = 0  # [ticks], by which the motor turned while its encoder was stuck
        self.temperature = _AMBIENT
        self.set("present_input_voltage", 50)
        self._motion = Motion(2048.0)
        self._age = 1000.0  # [s], since power on
        self._unheard = 0.0  # [s], since the last instruction on the line
        self._overloaded = 0.0  # [s]
        self._booting = 0.0  # [s], left
        self.advance(0.0)
        self.observe(self._motion)
        self.set("goal_position", self.get("present_position"))
        self.turns = None

    @property
    def booting(self) -> bool:
        """Whether it hears nothing because it restarts."""
        return self._booting > 0

    def heard(self) -> None:
        """An instruction packet came along the line: the watchdog starts counting anew."""
        self._unheard = 0.0

    def reboot(self) -> None:
        """Restart: RAM falls back, EEPROM stays, silence for a while."""
        self.reset_ram()
        self._booting, self._age, self._overloaded = BOOT_TIME, 0.0, 0.0
        self.turns = None
        self.observe(self._motion)
        self.set("goal_position", self.get("present_position"))

    def fail(self, bits: int) -> None:
        """Raise bits of the hardware error status; those in the shutdown mask end the torque."""
        self.set("hardware_error_status", self.get("hardware_error_status") | bits)
        if bits & self.get("shutdown"):
            self.set("torque_enable", 0)

    def drive(self) -> Drive:
        """What the motor is told."""
        speed = self.get("profile_velocity") * X330["profile_velocity"].scale / _TICK
        capped = self.get("operating_mode") == CURRENT_BASED_POSITION
        return Drive(
            torque=self.torque,
            goal=self.get("goal_position")
            - self.get("homing_offset")
            + self._unread
            + TICKS_PER_TURN * (self.turns or 0),
            current_cap=abs(self.get("goal_current")) if capped else self.get("current_limit"),
            p_gain=self.get("position_p_gain"),
            d_gain=self.get("position_d_gain"),
            speed=min(speed, _FREE_SPEED) if speed else _FREE_SPEED,
        )

    def advance(self, dt: float) -> None:
        """Let ``dt`` [s] pass."""
        self._age += dt
        self._booting = max(self._booting - dt, 0.0)
        self.set("realtime_tick", int(self._age * 1000) % 32768)
        self._watch(dt)
        self._load(dt)

    def observe(self, motion: Motion) -> None:
        """Take over what the motor did. A servo that was just switched on counts from 0 to 4095."""
        self._motion = motion
        if self.turns is None:
            self.turns = round(motion.position) // TICKS_PER_TURN
        count = round(motion.position) - TICKS_PER_TURN * self.turns + self.get("homing_offset")
        self._unread = count - self.get("present_position") if self.stuck else 0
        self.set("present_position", count - self._unread)
        moved = 0.0 if self.stuck else motion.velocity
        speed = round(moved * _TICK / X330["present_velocity"].scale)
        self.set("present_velocity", speed)
        self.set("present_current", round(motion.current))
        self.set("moving", int(abs(speed) > self.get("moving_threshold")))

    def _watch(self, dt: float) -> None:
        """The Bus Watchdog. That it "stops" is taken to mean "holds where it is" (assumed)."""
        self._unheard = self._unheard + dt if self.torque else 0.0
        limit = self.get("bus_watchdog")
        if limit > 0 and self._unheard > limit * X330["bus_watchdog"].scale:
            self.set("bus_watchdog", -1)
            self.set("goal_position", self.get("present_position"))

    def _load(self, dt: float) -> None:
        """Heat, and a load that lasts too long."""
        current = abs(self._motion.current)
        warm = _AMBIENT + _HEATING * (current / 1000) ** 2
        self.temperature += (warm - self.temperature) * min(dt / _COOLING_TIME, 1.0)
        self.set("present_temperature", round(self.temperature))
        self._overloaded = self._overloaded + dt if current > _OVERLOAD_CURRENT else 0.0
        if self._overloaded > _OVERLOAD_TIME:
            self.fail(OVERLOAD)
        if self.temperature > self.get("temperature_limit"):
            self.fail(OVERHEATING)
