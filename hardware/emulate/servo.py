# SPDX-License-Identifier: MIT
"""One XL330-M288-T as time goes by: clock, Bus Watchdog, heat, overload, reboot.

Only the position modes (3, 4, 5) move a motor. Not there: indirect registers, feedforward, the
acceleration of a profile.
"""

from __future__ import annotations

from hardware.servo.table import CURRENT_BASED_POSITION, XL330

from .memory import FAILED, ServoMemory
from .motor import Drive, Motion

BOOT_TIME = 0.3  # [s], silence after a reboot (assumed)
OVERHEATING, OVERLOAD = 1 << 2, 1 << 5  # bits of hardware_error_status

_TICK = XL330["goal_position"].scale  # [rad]
_FREE_SPEED = 7030.0  # [ticks/s], 103 rpm
_OVERLOAD_CURRENT = 800.0  # [mA], held for _OVERLOAD_TIME (assumed)
_OVERLOAD_TIME = 1.0  # [s] (assumed)
_AMBIENT = 28.0  # [degrees Celsius]
_HEATING = 40.0  # [K / A^2], in the end (assumed)
_COOLING_TIME = 60.0  # [s] (assumed)


class EmulatedServo(ServoMemory):
    """A servo without its line.

    Attributes:
        temperature: Of its motor [degrees Celsius].
    """

    def __init__(self, servo_id: int, baud: int = 57600) -> None:
        super().__init__(servo_id, baud)
        self.temperature = _AMBIENT
        self.set("present_input_voltage", 50)
        self._motion = Motion(2048.0)
        self._age = 1000.0  # [s], since power on
        self._unheard = 0.0  # [s], since the last instruction on the line
        self._overloaded = 0.0  # [s]
        self._booting = 0.0  # [s], left
        self._registered: tuple[int, bytes] | None = None
        self.advance(0.0)
        self.observe(self._motion)
        self.set("goal_position", self.get("present_position"))

    @property
    def booting(self) -> bool:
        """Whether it hears nothing because it restarts."""
        return self._booting > 0

    def heard(self) -> None:
        """An instruction packet came along the line: the watchdog starts counting anew."""
        self._unheard = 0.0

    def register(self, address: int, data: bytes) -> int:
        """Keep a write for ``action``; error number."""
        self._registered = (address, data)
        self.set("registered_instruction", 1)
        return 0

    def action(self) -> int:
        """Do the registered write; error number."""
        if self._registered is None:
            return FAILED
        (address, data), self._registered = self._registered, None
        self.set("registered_instruction", 0)
        return self.write(address, data)

    def reboot(self) -> None:
        """Restart: RAM falls back, EEPROM stays, silence for a while."""
        self.reset_ram()
        self._booting, self._age, self._overloaded = BOOT_TIME, 0.0, 0.0
        self._registered = None
        self.set("goal_position", self.get("present_position"))

    def factory_reset(self, kept: tuple[str, ...]) -> None:
        """EEPROM as delivered, except the registers kept, then a reboot."""
        for name, entry in XL330.items():
            if entry.eeprom and entry.writable and name not in kept:
                self.set(name, entry.initial)
        self.reboot()

    def fail(self, bits: int) -> None:
        """Raise bits of the hardware error status; those in the shutdown mask end the torque."""
        self.set("hardware_error_status", self.get("hardware_error_status") | bits)
        if bits & self.get("shutdown"):
            self.set("torque_enable", 0)

    def drive(self) -> Drive:
        """What the motor is told."""
        speed = self.get("profile_velocity") * XL330["profile_velocity"].scale / _TICK
        capped = self.get("operating_mode") == CURRENT_BASED_POSITION
        return Drive(
            torque=self.torque,
            goal=self.get("goal_position") - self.get("homing_offset"),
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
        """Take over what the motor did."""
        self._motion = motion
        speed = round(motion.velocity * _TICK / XL330["present_velocity"].scale)
        self.set("present_position", round(motion.position) + self.get("homing_offset"))
        self.set("present_velocity", speed)
        self.set("present_current", round(motion.current))
        self.set("moving", int(abs(speed) > self.get("moving_threshold")))

    def _watch(self, dt: float) -> None:
        """The Bus Watchdog. That it "stops" is taken to mean "holds where it is" (assumed)."""
        self._unheard = self._unheard + dt if self.torque else 0.0
        limit = self.get("bus_watchdog")
        if limit > 0 and self._unheard > limit * XL330["bus_watchdog"].scale:
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
