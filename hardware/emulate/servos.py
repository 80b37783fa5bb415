# SPDX-License-Identifier: MIT
"""A line of emulated X330 servos behind a pseudo terminal, byte by byte, with faults on demand.

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
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from random import Random

from .motor import FreeMotors, Plant
from .packets import BROADCAST, HEADER, Decoder, Instruction, Packet, pack, status
from .servo import EmulatedServo

_TICK = 0.005  # [s], how often the servos' time goes on without traffic
_TCGETS2 = 0x802C542A  # Linux: terminal settings with the speed as a number
_TERMIOS2 = struct.Struct("4I B 19s 2I")


class ServoLineEmulator:
    """Emulated servos on one line; a context manager.

    Args:
        ids: Ids of the servos.
        baud: The rate they are set to.
        models: Their models, by id; XL330-M288-T where not named.
        plant: What they move; free motors where None.
        model: Of all servos.

    Attributes:
        path: Name of the serial port.
        servos: The servos, by id. Hold ``lock`` to change them.
        doubles: Servos with an id that another one has.
        faults: What goes wrong.
        lock: Held while an instruction is carried out.
        heard: Instruction packets received so far.
    """

    def __init__(
        self,
        ids: Iterable[int],
        baud: int = 1_000_000,
        plant: Plant | None = None,
        model: str = "XL330-M288-T",
    ) -> None:
        self.servos = {i: EmulatedServo(i, baud, model) for i in ids}
        self.doubles: list[EmulatedServo] = []
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
        for answer in self._with_doubles(packet, answers(packet, hearing)):
            delay, data = self.faults.spoil(answer)
            self._outgoing.append((time.monotonic() + delay if delay else 0.0, data))

    def _with_doubles(self, packet: Packet, replies: Iterable[bytes]) -> Iterator[bytes]:
        """Replies as they are on the line when a second servo of the same id talks at the same time."""
        for reply in replies:
            for double in self.doubles:
                if double.servo_id == reply[len(HEADER)]:
                    for other in answers(packet, {double.servo_id: double}):
                        reply = bytes(a & b for a, b in zip(reply, other, strict=False))
            yield reply

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


@dataclass
class LineFaults:
    """Probabilities (a status packet each) and lasting faults; may be changed while it runs.

    Attributes:
        drop: The packet is lost.
        corrupt: One of its bits flips.
        truncate: Its end is missing.
        garbage: Noise comes before it.
        duplicate: It comes twice.
        delay: It and all after it come ``delay_time`` late, as when a USB hub stalls.
        delay_time: How late [s].
        lost_instruction: An instruction packet does not reach the servos (probability).
        echo: The adapter sends back what it is sent.
        silent: Ids of servos that are not there.
        seed: The same seed gives the same faults.
    """

    drop: float = 0.0
    corrupt: float = 0.0
    truncate: float = 0.0
    garbage: float = 0.0
    duplicate: float = 0.0
    delay: float = 0.0
    delay_time: float = 0.03
    lost_instruction: float = 0.0
    echo: bool = False
    silent: set[int] = field(default_factory=set)
    seed: int = 0

    def __post_init__(self) -> None:
        self._random = Random(self.seed)

    def loses_instruction(self) -> bool:
        """Whether this instruction packet is lost."""
        return self._random.random() < self.lost_instruction

    def spoil(self, packet: bytes) -> tuple[float, bytes]:
        """How late a status packet comes [s], and what is left of it."""
        chance = self._random.random
        if chance() < self.drop:
            packet = b""
        if packet and chance() < self.corrupt:
            packet = self._flip(packet)
        if packet and chance() < self.truncate:
            packet = packet[: self._random.randrange(len(packet))]
        if chance() < self.duplicate:
            packet = packet + packet
        if chance() < self.garbage:
            packet = self._random.randbytes(self._random.randint(1, 20)) + packet
        return (self.delay_time if chance() < self.delay else 0.0), packet

    def _flip(self, packet: bytes) -> bytes:
        at = self._random.randrange(len(packet))
        return packet[:at] + bytes([packet[at] ^ 1 << self._random.randrange(8)]) + packet[at + 1 :]


Servos = Mapping[int, EmulatedServo]  # those that hear the line now, by id

_UNKNOWN = 2  # error number: undefined instruction


def answers(packet: Packet, servos: Servos) -> Iterator[bytes]:
    """Status packets as bytes, in the order in which they go over the line; no port, no time.

    Source: ROBOTIS e-manual, "DYNAMIXEL Protocol 2.0", section "Instruction Details"; of its instructions those
    that this project and the clients in its tests send.
    """
    p = packet.parameters
    match packet.instruction:
        case Instruction.STATUS:
            return  # an adapter's echo
        case Instruction.SYNC_READ:
            yield from _in_turn(servos, _word(p, 0), _word(p, 2), p[4:])
        case Instruction.SYNC_WRITE:
            _sync_write(servos, p)
        case _ if packet.servo_id == BROADCAST:
            for servo_id in sorted(servos):  # all obey; only a ping is answered
                replies = _single(packet, servos[servo_id])
                if packet.instruction == Instruction.PING:
                    yield from replies
        case _ if packet.servo_id in servos:
            yield from _single(packet, servos[packet.servo_id])


def _single(packet: Packet, servo: EmulatedServo) -> list[bytes]:
    """The answer of one servo, or none, as its status return level says."""
    servo_id, level = servo.servo_id, servo.get("status_return_level")
    error, data = _obey(packet.instruction, packet.parameters, servo)
    asked = {0: {Instruction.PING}, 1: {Instruction.PING, Instruction.READ}}.get(level)
    if asked is not None and packet.instruction not in asked:
        return []
    return [status(servo_id, error | servo.alert, data)]


def _obey(instruction: int, p: bytes, servo: EmulatedServo) -> tuple[int, bytes]:
    """Do what one servo is told; error number and data of its answer."""
    match instruction:
        case Instruction.PING:
            return 0, servo.read(0, 2)[1] + servo.read(6, 1)[1]
        case Instruction.READ if len(p) == 4:
            return servo.read(_word(p, 0), _word(p, 2))
        case Instruction.WRITE if len(p) > 2:
            return servo.write(_word(p, 0), p[2:]), b""
        case Instruction.REBOOT:
            servo.reboot()
            return 0, b""
    return _UNKNOWN, b""


def _in_turn(servos: Servos, address: int, length: int, ids: bytes) -> Iterator[bytes]:
    """Each servo answers after the one before it; an absent one silences all that follow.

    (So says ROBOTIS in DynamixelSDK issue 364.)
    """
    for servo_id in ids:
        if servo_id not in servos:
            return
        servo = servos[servo_id]
        error, data = servo.read(address, length)
        yield status(servo_id, error | servo.alert, data)


def _sync_write(servos: Servos, p: bytes) -> None:
    """The same registers of many servos; nobody answers."""
    address, length = _word(p, 0), _word(p, 2)
    for k in range(4, len(p) - length, length + 1):
        if p[k] in servos:
            servos[p[k]].write(address, p[k + 1 : k + 1 + length])


def _word(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + 2], "little")
