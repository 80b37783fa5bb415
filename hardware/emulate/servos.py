# SPDX-License-Identifier: MIT
"""A line of emulated XL330s behind a pseudo terminal, byte by byte, with faults on demand.

Any program that drives real servos drives these by the name in ``path``: this project's own, the
Dynamixel SDK, rustypot. A pseudo terminal has no speed, but it knows which speed its client has set;
servos set to another one do not hear it.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import select
import struct
import threading
import time
import tty
from collections import deque
from collections.abc import Iterable

from .faults import LineFaults
from .line import answers
from .motor import FreeMotors, Plant
from .packets import Decoder, Packet, pack
from .servo import EmulatedServo

_TICK = 0.005  # [s], how often the servos' time goes on without traffic
_TCGETS2 = 0x802C542A  # Linux: terminal settings with the speed as a number
_TERMIOS2 = struct.Struct("4I B 19s 2I")


class ServoLineEmulator:
    """Emulated servos on one line; a context manager.

    Args:
        ids: Ids of the servos.
        baud: The rate they are set to.
        plant: What they move; free motors where None.

    Attributes:
        path: Name of the serial port.
        servos: The servos, by id. Hold ``lock`` to change them.
        faults: What goes wrong.
        lock: Held while an instruction is carried out.
        heard: Instruction packets received so far.
    """

    def __init__(
        self, ids: Iterable[int], baud: int = 1_000_000, plant: Plant | None = None
    ) -> None:
        self.servos = {i: EmulatedServo(i, baud) for i in ids}
        self.plant = FreeMotors() if plant is None else plant
        self.faults = LineFaults()
        self.lock = threading.Lock()
        self.heard = 0
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._decoder = Decoder()
        self._outgoing: deque[tuple[float, bytes]] = deque()
        self._now = time.monotonic()
        self._plugged = True
        self._running = True
        self._thread = threading.Thread(target=self._run, name="servo line", daemon=True)
        self._thread.start()

    def __enter__(self) -> ServoLineEmulator:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """End the emulation."""
        self._running = False
        self._thread.join()
        self.unplug()

    def unplug(self) -> None:
        """Pull the adapter out. The servos stay powered."""
        with self.lock:
            if self._plugged:
                self._plugged = False
                os.close(self._master)
                os.close(self._slave)

    def inject(self, data: bytes, delay: float = 0.0) -> None:
        """Put bytes on the line that no servo sent, ``delay`` [s] from now; all others wait behind."""
        with self.lock:
            self._outgoing.append((time.monotonic() + delay, data))

    def _run(self) -> None:
        while self._running:
            with self.lock:
                data = self._receive()
                self._advance()
                for packet in self._decoder.feed(data):
                    self._carry_out(packet)
                self._send()
            self._wait()

    def _wait(self) -> None:
        """Until something arrives or is due, at most a tick."""
        due = self._outgoing[0][0] - time.monotonic() if self._outgoing else _TICK
        timeout = min(max(due, 0.0), _TICK)
        try:
            select.select([self._master] if self._plugged else [], [], [], timeout)
        except (OSError, ValueError):  # unplugged meanwhile
            time.sleep(timeout)

    def _receive(self) -> bytes:
        """What the client sent; nothing where it cannot be understood."""
        if not self._plugged:
            return b""
        try:
            return os.read(self._master, 4096)
        except (BlockingIOError, InterruptedError):
            return b""

    def _advance(self) -> None:
        """Bring servos and plant to the present."""
        now = time.monotonic()
        dt, self._now = now - self._now, now
        for servo in self.servos.values():
            servo.advance(dt)
        motions = self.plant.advance(dt, {i: servo.drive() for i, servo in self.servos.items()})
        for servo_id, motion in motions.items():
            self.servos[servo_id].observe(motion)

    def _carry_out(self, packet: Packet) -> None:
        """Let the servos that can hear it obey a packet, and queue what they answer."""
        self.heard += 1
        if self.faults.echo:
            self._outgoing.append((0.0, pack(packet)))
        if self.faults.loses_instruction():
            return
        speed = _speed(self._slave)
        hearing = {
            i: servo
            for i, servo in ((s.servo_id, s) for s in self.servos.values())
            if servo.baud == speed and not servo.booting and i not in self.faults.silent
        }
        for servo in hearing.values():
            servo.heard()
        for answer in answers(packet, hearing):
            delay, data = self.faults.spoil(answer)
            self._outgoing.append((time.monotonic() + delay if delay else 0.0, data))

    def _send(self) -> None:
        """What is due goes out, in order: nothing overtakes a delayed packet."""
        while self._outgoing and self._outgoing[0][0] <= time.monotonic():
            data = self._outgoing.popleft()[1]
            if self._plugged:
                with contextlib.suppress(BlockingIOError):  # nobody reads: lost, as on a real line
                    os.write(self._master, data)


def _speed(terminal: int) -> int:
    """The rate a terminal's client has set [baud]."""
    settings = fcntl.ioctl(terminal, _TCGETS2, bytes(_TERMIOS2.size))
    speed: int = _TERMIOS2.unpack(settings)[-1]
    return speed
