# SPDX-License-Identifier: MIT
"""A serial port for the Dynamixel SDK that waits without spinning and ends on time.

What differs from the SDK's own ``PortHandler`` (dynamixel-sdk 4.1), and why:

- Reads block in the kernel for a moment instead of spinning (90 % of a core, and of the interpreter
  lock, while a reply is missing).
- A deadline that has passed while the bytes already lie in the buffer is no timeout: the thread was
  only late to look. But noise that never ends does end the wait.
- The port is opened exclusively: a second program would steal bytes, unnoticed.
- Timeouts are ours: the SDK always allows 34 ms for a lost packet.
"""

from __future__ import annotations

import contextlib
import errno
import logging
import time
from pathlib import Path
from typing import Any

import serial
from dynamixel_sdk import PortHandler

from hardware.serial_errors import PORT_ERRORS

log = logging.getLogger(__name__)

QUIET = 0.010  # [s], a line this long without a byte has nothing more to say
_POLL = 0.002  # [s], longest time a read blocks before the deadline is looked at
_WRITE_TIMEOUT = 1.0  # [s], pyserial counts the time it is kept from running as well
_SLOW = 0.002  # [s], an adapter that keeps bytes back for longer costs cycles
_BABBLE = 0.1  # [s], how long bytes that never end may go on after the deadline


class Port(PortHandler):
    """An open serial port.

    Raises:
        ValueError: The SDK does not know this baud rate.
        OSError: The port cannot be opened (serial.SerialException is one).
    """

    def __init__(self, path: str, baud: int) -> None:
        super().__init__(path)
        self.ser: Any = None
        self._held_back = 0.0  # [s], by the adapter
        self._deadline = 0.0
        self._last_byte = time.monotonic()
        if self.getCFlagBaud(baud) <= 0:
            raise ValueError(
                f"the Dynamixel SDK cannot set {baud} baud; use 57600 or 1 to 4 million"
            )
        self.setBaudRate(baud)

    def setupPort(self, cflag_baud: int) -> bool:
        """Open the port; called by the SDK's ``setBaudRate``."""
        self.closePort()
        self.ser = serial.Serial(
            self.port_name, cflag_baud, timeout=_POLL, write_timeout=_WRITE_TIMEOUT, exclusive=True
        )
        # An FTDI adapter otherwise keeps bytes back for 16 ms. Not every adapter knows this.
        with contextlib.suppress(ValueError, *PORT_ERRORS):
            self.ser.set_low_latency_mode(True)
        self._held_back = latency_timer(self.port_name) or 0.0
        if self._held_back > _SLOW:
            late = f"{1000 * self._held_back:.0f} ms"
            log.warning("%s keeps bytes back for %s: see hardware/README.md", self.port_name, late)
        self.is_open = True
        self.is_using = False
        self.tx_time_per_byte = 10_000.0 / cflag_baud  # [ms], 10 bits a byte
        self.ser.reset_input_buffer()
        return True

    def closePort(self) -> None:
        """Close the port if it is open; never raises, also when the adapter is gone."""
        self.is_open = False
        if self.ser is not None:
            with contextlib.suppress(*PORT_ERRORS):
                self.ser.close()

    def readPort(self, length: int) -> bytes:
        """At most ``length`` bytes; fewer after 2 ms, none once the line has babbled too long."""
        if length <= 0 or time.monotonic() > self._deadline + _BABBLE:
            return b""
        data: bytes = self.ser.read(length)
        if data:
            self._last_byte = time.monotonic()
        return data

    def expect(self, length: int, patience: float) -> None:
        """Set the deadline for ``length`` bytes: their time on the line and ``patience`` [s]."""
        on_the_line = length * self.tx_time_per_byte / 1000
        self._deadline = time.monotonic() + on_the_line + self._held_back + patience

    def setPacketTimeout(self, packet_length: int) -> None:
        """The SDK's own way to set the deadline; with its 34 ms."""
        self.expect(packet_length, 0.034)

    def setPacketTimeoutMillis(self, msec: float) -> None:
        """Set the deadline ``msec`` from now."""
        self.expect(0, msec / 1000)

    def isPacketTimeout(self) -> bool:
        """Whether the deadline has passed and no byte waits, or bytes never end."""
        late = time.monotonic() - self._deadline
        return late > _BABBLE or (late > 0 and self.ser.in_waiting == 0)

    def drain(self) -> None:
        """Forget what arrives until the line has been quiet for 10 ms.

        Raises:
            OSError: It never falls silent.
        """
        give_up = time.monotonic() + _BABBLE + QUIET
        while True:
            now = time.monotonic()
            waiting = self.ser.in_waiting
            if waiting:
                self.ser.read(waiting)
                self._last_byte = now
            elif now - self._last_byte >= QUIET:
                return
            if now > give_up:
                raise OSError("the line never falls silent: is another program or device talking?")
            time.sleep(QUIET / 10)


def latency_timer(path: str) -> float | None:
    """How long an FTDI adapter keeps bytes back [s]; None where the port has no such timer."""
    device = Path(path).resolve().name
    try:
        text = Path(f"/sys/bus/usb-serial/devices/{device}/latency_timer").read_text()
        return int(text) / 1000
    except (OSError, ValueError):
        return None


def why_not_open(path: str, error: BaseException) -> str:
    """Why a port did not open, and what to do."""
    number = getattr(error, "errno", None)
    if number == errno.ENOENT:
        return f"there is no port {path}: is the adapter plugged in? see /dev/serial/by-id"
    if number in (errno.EACCES, errno.EPERM):
        return f"no permission to open {path}: add yourself to the group that owns it (dialout)"
    if number in (errno.EAGAIN, errno.EBUSY):
        return f"another program has {path} open: end it first"
    return f"cannot open the servo port {path}: {error}"
