# SPDX-License-Identifier: MIT
"""The control table of the X330 servos, as data, and what differs between them.

Source: ROBOTIS e-manual, "XL330-M288-T", "XC330-M288-T" and "XC330-T288-T", sections "Control Table of EEPROM
Area" and "Control Table of RAM Area", https://emanual.robotis.com/docs/en/dxl/x/xl330-m288/ . Addresses, sizes
and units are the same for all; starting values are the XL330-M288-T's. Which registers are signed is
not in its tables but in the ranges it describes. Indirect registers (168 and up) are left out: all
that is read in a cycle stands together.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass

TICKS_PER_TURN = 4096
CURRENT_BASED_POSITION = 5  # the operating mode in which Goal Current caps the current
CAREFUL_SHUTDOWN = 53  # torque off on overload 32, electrical shock 16, overheating 4, voltage 1
BAUD_CODES = {9600: 0, 57600: 1, 115200: 2, 1000000: 3, 2000000: 4, 3000000: 5, 4000000: 6}

# Bits of hardware_error_status (70).
HARDWARE_ERRORS = {
    0: "input voltage",
    2: "overheating",
    3: "motor encoder",
    4: "electrical shock or too little power",
    5: "overload",
}

ALERT = 0x80  # bit of a status packet's error byte: hardware_error_status is not zero
# The rest of the error byte (e-manual, "DYNAMIXEL Protocol 2.0", section "Error").
STATUS_ERRORS = {
    1: "could not do it",
    2: "does not know the instruction",
    3: "received it damaged",
    4: "says the value is out of range",
    5: "says the data has the wrong length",
    6: "says the value is beyond a limit",
    7: "does not allow access there now (some registers are locked while torque is on)",
}


@dataclass(frozen=True)
class Register:
    """One entry of the control table.

    Attributes:
        address: Address of its first byte.
        size: Bytes, little-endian.
        low: Least count; where it is negative, the register is signed.
        high: Largest count.
        initial: Count after delivery (EEPROM) or after power on (RAM).
        scale: SI units (or degrees Celsius) of one count; 1 where a count has no unit.
        writable: Whether it can be written at all.
    """

    address: int
    size: int
    low: int = 0
    high: int = 0
    initial: int = 0
    scale: float = 1.0
    writable: bool = True

    @property
    def signed(self) -> bool:
        """Whether the bytes are a two's complement."""
        return self.low < 0

    @property
    def eeprom(self) -> bool:
        """Whether it survives power off; such registers wear out and are locked under torque."""
        return self.address < 64


def _read_only(address: int, size: int, scale: float = 1.0, signed: bool = False) -> Register:
    low = -(1 << (8 * size - 1)) if signed else 0
    return Register(address, size, low, low + (1 << 8 * size) - 1, scale=scale, writable=False)


@dataclass(frozen=True)
class Model:
    """A kind of servo.

    Attributes:
        number: What it answers to a ping.
        largest_current: Of its Current Limit [mA].
        supply: Voltages between which it works well [V].
    """

    number: int
    largest_current: int
    supply: tuple[float, float]


MODELS = {
    "XL330-M288-T": Model(1200, 1750, (4.5, 5.5)),  # 3.7 to 6 V, 5 V recommended
    "XC330-M288-T": Model(1240, 2352, (4.5, 5.5)),
    "XC330-T288-T": Model(1220, 910, (9.0, 12.6)),  # 5.5 to 14 V, 11.1 V recommended
}


def model_name(number: int) -> str:
    """What a servo is called that answers with this model number."""
    return next(
        (name for name, model in MODELS.items() if model.number == number), f"model {number}"
    )


_TICK = 2 * math.pi / TICKS_PER_TURN  # [rad]
_RPM = 0.229 * 2 * math.pi / 60  # [rad/s]
_MA = 1e-3  # [A]
_TURNS = 256 * TICKS_PER_TURN - 1  # modes 4 and 5 count turns and ignore the position limits

# fmt: off
X330: dict[str, Register] = {
    # EEPROM                           address size   low    high  initial
    "model_number":            _read_only(0, 2),
    "model_information":       _read_only(2, 4),
    "firmware_version":        _read_only(6, 1),
    "id":                        Register(7, 1,         0,    252,    1),
    "baud_rate":                 Register(8, 1,         0,      6,    1),
    "return_delay_time":         Register(9, 1,         0,    254,  250, scale=2e-6),
    "drive_mode":               Register(10, 1,         0,     13,    0),  # bits 0, 2, 3
    "operating_mode":           Register(11, 1,         0,     16,    3),
    "secondary_id":             Register(12, 1,         0,    255,  255),
    "protocol_type":            Register(13, 1,         2,     22,    2),
    "homing_offset":            Register(20, 4, -1_044_479, 1_044_479, 0, scale=_TICK),
    "moving_threshold":         Register(24, 4,         0,   1023,   10, scale=_RPM),
    "temperature_limit":        Register(31, 1,         0,    100,   70),
    "max_voltage_limit":        Register(32, 2,        31,    140,   70, scale=0.1),
    "min_voltage_limit":        Register(34, 2,        31,    140,   35, scale=0.1),
    "pwm_limit":                Register(36, 2,         0,    885,  885),
    "current_limit":            Register(38, 2,         0,   2352, 1750, scale=_MA),
    "velocity_limit":           Register(44, 4,         0,   2047,  445, scale=_RPM),
    "max_position_limit":       Register(48, 4,         0,   4095, 4095, scale=_TICK),
    "min_position_limit":       Register(52, 4,         0,   4095,    0, scale=_TICK),
    "startup_configuration":    Register(60, 1,         0,      3,    0),
    "pwm_slope":                Register(62, 1,         1,    255,  140),
    "shutdown":                 Register(63, 1,         0,    255, CAREFUL_SHUTDOWN),
    # RAM
    "torque_enable":            Register(64, 1,         0,      1,    0),
    "led":                      Register(65, 1,         0,      1,    0),
    "status_return_level":      Register(68, 1,         0,      2,    2),
    "registered_instruction":   _read_only(69, 1),
    "hardware_error_status":    _read_only(70, 1),
    "velocity_i_gain":          Register(76, 2,         0, 16_383, 1600),
    "velocity_p_gain":          Register(78, 2,         0, 16_383,  180),
    "position_d_gain":          Register(80, 2,         0, 16_383,    0),
    "position_i_gain":          Register(82, 2,         0, 16_383,    0),
    "position_p_gain":          Register(84, 2,         0, 16_383,  400),
    "feedforward_2nd_gain":     Register(88, 2,         0, 16_383,    0),
    "feedforward_1st_gain":     Register(90, 2,         0, 16_383,    0),
    "bus_watchdog":             Register(98, 1,        -1,    127,    0, scale=0.02),
    "goal_pwm":                Register(100, 2,      -885,    885,  885),
    "goal_current":            Register(102, 2,     -2352,   2352, 1750, scale=_MA),
    "goal_velocity":           Register(104, 4,     -2047,   2047,  445, scale=_RPM),
    "profile_acceleration":    Register(108, 4,         0, 32_767,    0),
    "profile_velocity":        Register(112, 4,         0, 32_767,    0, scale=_RPM),
    "goal_position":           Register(116, 4,    -_TURNS, _TURNS,   0, scale=_TICK),
    "realtime_tick":           _read_only(120, 2, 1e-3),
    "moving":                  _read_only(122, 1),
    "moving_status":           _read_only(123, 1),
    "present_pwm":             _read_only(124, 2, signed=True),
    "present_current":         _read_only(126, 2, _MA, signed=True),
    "present_velocity":        _read_only(128, 4, _RPM, signed=True),
    "present_position":        _read_only(132, 4, _TICK, signed=True),
    "velocity_trajectory":     _read_only(136, 4, _RPM, signed=True),
    "position_trajectory":     _read_only(140, 4, _TICK, signed=True),
    "present_input_voltage":   _read_only(144, 2, 0.1),
    "present_temperature":     _read_only(146, 1),
    "backup_ready":            _read_only(147, 1),
}
# fmt: on


_FORMATS = {(1, False): "B", (2, False): "H", (4, False): "I"}
_FORMATS |= {(size, True): letter.lower() for (size, _), letter in _FORMATS.items()}


def register(name: str) -> Register:
    """The register of that name; an unknown one is a ValueError that lists those alike."""
    if name not in X330:
        alike = [known for known in X330 if set(name.split("_")) & set(known.split("_"))]
        raise ValueError(f"no register {name!r}; alike: {', '.join(alike) or ', '.join(X330)}")
    return X330[name]


def encode(name: str, count: int) -> bytes:
    """Bytes of a count as they go over the line.

    Raises:
        ValueError: The register cannot be written, or not with this count.
    """
    entry = register(name)
    if not entry.writable:
        raise ValueError(f"{name} can only be read")
    if isinstance(count, bool) or int(count) != count or not entry.low <= count <= entry.high:
        raise ValueError(f"{name} must be a whole number in {entry.low}..{entry.high}, got {count}")
    return int(count).to_bytes(entry.size, "little", signed=entry.signed)


def decode(name: str, data: bytes) -> int:
    """Count that a register's bytes stand for."""
    entry = register(name)
    if len(data) != entry.size:
        raise ValueError(f"{name} has {entry.size} bytes, got {len(data)}")
    return int.from_bytes(data, "little", signed=entry.signed)


def to_si(name: str, count: float) -> float:
    """A count in SI units [rad, rad/s, A, V, s; degrees Celsius for temperatures]."""
    return count * register(name).scale


def from_si(name: str, value: float) -> int:
    """The count nearest to a value in SI units."""
    return round(value / register(name).scale)


class Block:
    """Registers that stand near each other, read together with what lies between them.

    Attributes:
        names: Their names.
        address: Address of the first.
        size: Bytes of all.
    """

    def __init__(self, names: Sequence[str]) -> None:
        entries = [register(name) for name in names]
        self.names = tuple(names)
        self.address = at = entries[0].address
        layout = "<"
        for name, entry in zip(names, entries, strict=True):
            if entry.address < at:
                raise ValueError(f"a block must be in the order of addresses, {name} is not")
            layout += f"{entry.address - at}x{_FORMATS[entry.size, entry.signed]}"
            at = entry.address + entry.size
        self._struct = struct.Struct(layout)
        self.size = self._struct.size

    def decode(self, data: bytes) -> dict[str, int]:
        """Counts by register name."""
        return dict(zip(self.names, self._struct.unpack(data), strict=True))


# All that matters in one piece: whether the last goal arrived, clock, motion, supply, heat.
STATE = Block(
    [
        "goal_position",
        "realtime_tick",
        "moving",
        "moving_status",
        "present_pwm",
        "present_current",
        "present_velocity",
        "present_position",
        "velocity_trajectory",
        "position_trajectory",
        "present_input_voltage",
        "present_temperature",
    ]
)

# What says whether a servo still obeys; read of one servo at a time, as it takes no goals from it.
OBEDIENCE = Block(["torque_enable", "hardware_error_status", "bus_watchdog"])
