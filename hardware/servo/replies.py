# SPDX-License-Identifier: MIT
"""Which status packets answer the question that was asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Reply:
    """One status packet: who sent it, its error byte, its data, and when it came [s]."""

    servo_id: int
    error: int
    data: bytes
    arrived: float


def parse(raw: Sequence[int], arrived: float) -> Reply | None:
    """Take apart a status packet as the SDK hands it over (CRC checked, stuffing removed).

    Byte 4 is the id, bytes 5 and 6 the length of what follows, byte 8 the error; behind the data
    stand two bytes of CRC. The list may be longer than the packet: removing stuffing does not cut it.
    None where the length is too short for a status packet.
    """
    length = raw[5] | raw[6] << 8
    if length < 4:
        return None
    return Reply(raw[4], raw[8], bytes(raw[9 : 5 + length]), arrived)


def in_order(arrived: Sequence[Reply], asked: Sequence[int]) -> dict[int, Reply]:
    """The replies to a sync read, by servo id, without those that came out of turn.

    Servos answer in the order in which they were asked. So a packet that arrived before one from a
    servo asked earlier, or before a second one from the same servo, was made for an earlier question.
    """
    turn = {servo_id: index for index, servo_id in enumerate(asked)}
    replies: dict[int, Reply] = {}
    earliest = len(asked)
    for reply in reversed(arrived):
        if turn[reply.servo_id] < earliest:
            earliest = turn[reply.servo_id]
            replies[reply.servo_id] = reply
    return {i: replies[i] for i in asked if i in replies}
