# SPDX-License-Identifier: MIT
"""What servos on one line answer to an instruction packet; no port, no time.

Source: ROBOTIS e-manual, "DYNAMIXEL Protocol 2.0", section "Instruction Details". Not there: Fast
Bulk Read, Control Table Backup.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from fastcrc import crc16

from .memory import FAILED
from .packets import BROADCAST, HEADER, Instruction, Packet, status
from .servo import EmulatedServo

Servos = Mapping[int, EmulatedServo]  # those that hear the line now, by id

_UNKNOWN = 2  # error number: undefined instruction
_CLEAR_TURNS = b"\x01\x44\x58\x4c\x22"
_KEPT = {0xFF: (), 0x01: ("id",), 0x02: ("id", "baud_rate")}  # by option of a factory reset


def answers(packet: Packet, servos: Servos) -> Iterator[bytes]:
    """Status packets as bytes, in the order in which they go over the line."""
    p = packet.parameters
    match packet.instruction:
        case Instruction.STATUS:
            return  # an adapter's echo
        case Instruction.SYNC_READ:
            yield from _in_turn(servos, [(i, _word(p, 0), _word(p, 2)) for i in p[4:]])
        case Instruction.BULK_READ:
            asked = [p[k : k + 5] for k in range(0, len(p) - 4, 5)]
            yield from _in_turn(servos, [(q[0], _word(q, 1), _word(q, 3)) for q in asked])
        case Instruction.FAST_SYNC_READ:
            yield _fast(servos, p[4:], _word(p, 0), _word(p, 2))
        case Instruction.SYNC_WRITE:
            _sync_write(servos, p)
        case Instruction.BULK_WRITE:
            _bulk_write(servos, p)
        case _ if packet.servo_id == BROADCAST:
            yield from _broadcast(packet, servos)
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


def _broadcast(packet: Packet, servos: Servos) -> Iterator[bytes]:
    """All servos obey; only a ping is answered, in the order of ids."""
    for servo_id in sorted(servos):
        replies = _single(packet, servos[servo_id])
        if packet.instruction == Instruction.PING:
            yield from replies


def _obey(instruction: int, p: bytes, servo: EmulatedServo) -> tuple[int, bytes]:
    """Do what one servo is told; error number and data of its answer."""
    match instruction:
        case Instruction.PING:
            return 0, servo.read(0, 2)[1] + servo.read(6, 1)[1]
        case Instruction.READ if len(p) == 4:
            return servo.read(_word(p, 0), _word(p, 2))
        case Instruction.WRITE if len(p) > 2:
            return servo.write(_word(p, 0), p[2:]), b""
        case Instruction.REG_WRITE if len(p) > 2:
            return servo.register(_word(p, 0), p[2:]), b""
        case Instruction.ACTION:
            return servo.action(), b""
        case Instruction.FACTORY_RESET if p and p[0] in _KEPT:
            servo.factory_reset(_KEPT[p[0]])
            return 0, b""
        case Instruction.REBOOT:
            servo.reboot()
            return 0, b""
        case Instruction.CLEAR:
            return (0 if p == _CLEAR_TURNS and not servo.torque else FAILED), b""
    return _UNKNOWN, b""


def _in_turn(servos: Servos, asked: Iterable[tuple[int, int, int]]) -> Iterator[bytes]:
    """Each servo answers after the one before it; an absent one silences all that follow.

    (So says ROBOTIS in DynamixelSDK issue 364.)
    """
    for servo_id, address, length in asked:
        if servo_id not in servos:
            return
        servo = servos[servo_id]
        error, data = servo.read(address, length)
        yield status(servo_id, error | servo.alert, data)


def _fast(servos: Servos, ids: bytes, address: int, length: int) -> bytes:
    """One packet to which each servo adds its part: error, id, data, CRC of all so far."""
    size = 1 + len(ids) * (length + 4)
    line = HEADER + bytes([BROADCAST]) + size.to_bytes(2, "little") + bytes([Instruction.STATUS])
    for servo_id in ids:
        if servo_id not in servos:
            break
        servo = servos[servo_id]
        error, data = servo.read(address, length)
        line += bytes([error | servo.alert, servo_id]) + data
        line += crc16.umts(line).to_bytes(2, "little")
    return line


def _sync_write(servos: Servos, p: bytes) -> None:
    """The same registers of many servos; nobody answers."""
    address, length = _word(p, 0), _word(p, 2)
    for k in range(4, len(p) - length, length + 1):
        if p[k] in servos:
            servos[p[k]].write(address, p[k + 1 : k + 1 + length])


def _bulk_write(servos: Servos, p: bytes) -> None:
    """Any registers of many servos; nobody answers."""
    while len(p) > 5:
        servo_id, address, length = p[0], _word(p, 1), _word(p, 3)
        if servo_id in servos:
            servos[servo_id].write(address, p[5 : 5 + length])
        p = p[5 + length :]


def _word(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + 2], "little")
