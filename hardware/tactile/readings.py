# SPDX-License-Identifier: MIT
"""From frames to readings: the instant of each, by the host's clock, and which are missing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hardware.device_clock import DeviceClock

from .frame import Frame


@dataclass(frozen=True, eq=False)
class PadReading:
    """What the board measured at one instant.

    Attributes:
        time: When the board measured, by the host's monotonic clock [s].
        board_time: The same instant by the board's clock [s since it started].
        values: Readings of the inputs, shape (N,), uint16; 65535 is the supply voltage.
    """

    time: float
    board_time: float
    values: np.ndarray


class FrameTimer:
    """Tells the instant of each frame and counts those that are missing.

    Attributes:
        lost: Frames missing so far.
        restarts: Restarts of the board so far.
    """

    def __init__(self) -> None:
        self.lost = 0
        self.restarts = 0
        self._clock = DeviceClock()
        self._last: Frame | None = None
        self._received = 0.0
        self._board_time = 0.0

    def reading(self, frame: Frame, received: float) -> PadReading | None:
        """The frame with its instant, or None where it repeats the last one.

        Args:
            frame: A frame as it arrived.
            received: When it arrived, by the host's monotonic clock [s].
        """
        last, self._last = self._last, frame
        if last is not None and frame.sequence == last.sequence:
            return None
        elapsed = self._elapsed(last, frame)
        if elapsed > received - self._received + 1.0 and last is not None:
            # The board's clock cannot have run ahead of ours: it went back, modulo 2^32.
            self.restarts += 1
            self._clock.restart()
            self._board_time = frame.board_time_us * 1e-6
        else:
            self.lost += 0 if last is None else (frame.sequence - last.sequence - 1) % 2**16
            self._board_time += elapsed
        self._received = received
        instant = self._clock.to_host(self._board_time, received)
        return PadReading(instant, self._board_time, np.array(frame.readings, dtype=np.uint16))

    @staticmethod
    def _elapsed(last: Frame | None, frame: Frame) -> float:
        before = 0 if last is None else last.board_time_us
        return (frame.board_time_us - before) % 2**32 * 1e-6
