# SPDX-License-Identifier: MIT
"""Which status packets answer the question that was asked, and how many questions got an answer."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
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


_BAD = 0.01  # share of lost answers that deserves a word


class Traffic:
    """Counts over the life of a bus.

    Attributes:
        asked: Questions to each servo, by id.
        answered: Good answers of each servo, by id.
        last_answer: When each servo last answered well, monotonic clock [s], by id.
        damaged: Packets with a wrong CRC or without an end.
        foreign: Whole packets that answered no question asked.
    """

    def __init__(self) -> None:
        self.asked: Counter[int] = Counter()
        self.answered: Counter[int] = Counter()
        self.last_answer: dict[int, float] = {}
        self.damaged = 0
        self.foreign = 0

    def count(self, servo_id: int, answered: bool, now: float) -> None:
        """Note one question and whether a good answer came."""
        self.asked[servo_id] += 1
        if answered:
            self.answered[servo_id] += 1
            self.last_answer[servo_id] = now

    def lost(self, servo_id: int) -> float:
        """Share of questions to a servo without a good answer; 0 where none was asked."""
        asked = self.asked[servo_id]
        return 1 - self.answered[servo_id] / asked if asked else 0.0

    def diagnosis(self, label: Callable[[int], str] = str) -> str:
        """One sentence on what is wrong, or an empty string.

        Args:
            label: How to call the servo of an id.
        """
        if self.asked and not self.answered:
            if self.damaged or self.foreign:
                return "only noise comes back: another baud rate, or another device on the line?"
            return "nothing comes back: check power, port and baud rate"
        bad = sorted((i for i in self.asked if self.lost(i) > _BAD), key=self.lost, reverse=True)
        if not bad:
            return ""
        shares = ", ".join(f"{label(i)} {100 * self.lost(i):.0f} %" for i in bad[:3])
        cause = "damaged packets" if self.damaged else "no packets at all"
        return f"answers lost ({cause}): {shares}; check cables and supply, or lower the baud rate"
