# SPDX-License-Identifier: MIT
"""What goes wrong on an emulated servo line."""

from __future__ import annotations

from dataclasses import dataclass, field
from random import Random


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
