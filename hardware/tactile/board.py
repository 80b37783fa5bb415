# SPDX-License-Identifier: MIT
"""The pad board on a serial port: a thread that reads it and the newest set of readings.

"No data" and "no contact" look alike to who only sees the last value. So each set carries the
instant at which the board measured it, which stays behind when nothing new arrives, and the frames
that the sequence number shows to be missing are counted.
"""

from __future__ import annotations

import errno
import os
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hardware.device_clock import DeviceClock
from hardware.serial_errors import PORT_ERRORS
from vtgtsam.exceptions import VtgtsamError

from .frame import READINGS, Frame, FrameReader, FrameVersionError

BAUD = 115_200  # a board on native USB ignores it
_BAD = 0.01  # share of lost frames that deserves a word
_HISTORY = 3000  # [readings], a minute at 50 Hz
_POLL = 0.05  # [s], the longest wait of the reading thread


class PadBoardError(VtgtsamError):
    """The pad board cannot be opened, was unplugged, or does not send what it should."""


_NOT_OPENED = (*PORT_ERRORS, ValueError)
_GONE = (*PORT_ERRORS, FrameVersionError, PadBoardError)


@dataclass(frozen=True)
class BoardCounts:
    """How well the connection to the board works.

    Attributes:
        bytes: Bytes received.
        frames: Whole frames received.
        bad: Damaged frames.
        lost: Frames missing by their sequence number, the damaged ones among them.
        restarts: How often the board's clock started again.
    """

    bytes: int = 0
    frames: int = 0
    bad: int = 0
    lost: int = 0
    restarts: int = 0

    def diagnosis(self) -> str:
        """One sentence on what is wrong, or an empty string."""
        if self.bytes == 0:
            return "nothing arrives: is it the right port, has the board power and its sketch?"
        if self.frames == 0:
            return (
                f"{self.bytes} bytes arrived but no frame: another device, another baud rate, or "
                "another sketch than hardware/firmware/pad_board"
            )
        found = []
        if self.lost > _BAD * self.frames:
            found.append(
                f"{self.lost} of {self.frames + self.lost} frames were lost: check cable and hub"
            )
        if self.restarts:
            times = "once" if self.restarts == 1 else f"{self.restarts} times"
            found.append(f"the pad board restarted {times}: check its power supply")
        return "; ".join(found)


class PadBoard:
    """A pad board that is being read; a context manager.

    Attributes:
        port: Where the board is.
        inputs: How many inputs it has.
    """

    def __init__(
        self,
        port: str,
        inputs: int,
        baud: int = BAUD,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Open the port and begin to read.

        Args:
            port: The serial port, best by its name in /dev/serial/by-id.
            inputs: How many inputs the hand's description gives the board.
            baud: Baud rate [bit/s].
            clock: The host's monotonic clock [s].

        Raises:
            PadBoardError: The port is not there, not ours to read, or in use.
        """
        self.port = port
        self.inputs = inputs
        self._clock = clock
        self._counts = BoardCounts()
        self._history: deque[PadReading] = deque(maxlen=_HISTORY)
        self._lock = threading.Lock()
        self._error: PadBoardError | None = None
        self._stop = threading.Event()
        self._serial = _open(port, baud)
        self._thread = threading.Thread(target=self._run, name="pad-board", daemon=True)
        self._thread.start()

    def __enter__(self) -> PadBoard:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop reading and give the port back."""
        self._stop.set()
        self._thread.join()
        self._serial.close()

    def wait(self, seconds: float = 3.0) -> PadReading:
        """The first reading; a board that resets when its port is opened takes a second or two.

        Raises:
            PadBoardError: None came in that time, with what the bytes that came tell.
        """
        deadline = self._clock() + seconds
        while self._clock() < deadline:
            reading = self.latest()
            if reading is not None:
                return reading
            time.sleep(0.005)
        raise PadBoardError(
            f"no readings from the pad board on {self.port} in {seconds:g} s: "
            + self.counts().diagnosis()
        )

    def latest(self) -> PadReading | None:
        """The newest reading, whose age is the caller's to judge; None before the first.

        Raises:
            PadBoardError: The board was unplugged or sends what this program cannot use.
        """
        with self._lock:
            if self._error is not None:
                raise self._error
            return self._history[-1] if self._history else None

    def since(self, instant: float) -> list[PadReading]:
        """The readings measured after that instant of the host's monotonic clock, at most 3000.

        Raises:
            PadBoardError: As in ``latest``.
        """
        self.latest()
        with self._lock:
            return [reading for reading in self._history if reading.time > instant]

    def record(self, seconds: float) -> np.ndarray:
        """All readings of the next seconds, shape (T, N); waits for them.

        Raises:
            PadBoardError: The board was unplugged, or sent nothing or too little.
        """
        start = self._clock()
        while self._clock() < start + seconds:
            self.latest()
            time.sleep(_POLL)
        readings = self.since(start)
        if len(readings) < 10:
            raise PadBoardError(
                f"the pad board on {self.port} sent {len(readings)} readings in {seconds:g} s; "
                + (self.counts().diagnosis() or "is its cable loose?")
            )
        return np.array([reading.values for reading in readings])

    def counts(self) -> BoardCounts:
        """How well the connection has worked so far."""
        with self._lock:
            return self._counts

    def _run(self) -> None:
        reader, timer = FrameReader(), FrameTimer()
        while not self._stop.is_set():
            try:
                chunk = self._serial.read(max(1, self._serial.in_waiting))
                self._take(reader, timer, chunk)
            except _GONE as error:
                self._fail(error)
                return

    def _take(self, reader: FrameReader, timer: FrameTimer, chunk: bytes) -> None:
        received = self._clock()
        frames = [frame for frame in reader.feed(chunk) if frame.kind == READINGS]
        for frame in frames:
            if len(frame.readings) != self.inputs:
                raise PadBoardError(
                    f"the pad board on {self.port} has {len(frame.readings)} inputs, the hand's "
                    f"description {self.inputs}: make its list of pad inputs and the sketch agree"
                )
        readings = [timer.reading(frame, received) for frame in frames]
        with self._lock:
            self._history.extend(reading for reading in readings if reading is not None)
            self._counts = replace(
                self._counts,
                bytes=reader.bytes_seen,
                frames=self._counts.frames + len(frames),
                bad=reader.bad,
                lost=timer.lost,
                restarts=timer.restarts,
            )

    def _fail(self, error: Exception) -> None:
        if not isinstance(error, PadBoardError):
            advice = "" if isinstance(error, FrameVersionError) else "; is it plugged in?"
            error = PadBoardError(f"lost the pad board on {self.port}: {error}{advice}")
        with self._lock:
            self._error = error


def _open(port: str, baud: int) -> Any:
    import serial

    try:  # opening also forgets what the system kept from before
        return serial.Serial(port, baud, timeout=_POLL, exclusive=True)
    except _NOT_OPENED as error:
        raise PadBoardError(
            f"cannot open the pad board on {port}: {_reason(error)}; check the port's name, that no other "
            "program reads it, and that you may (group dialout)"
        ) from error


def _reason(error: Exception) -> str:
    """Why a port does not open; pyserial gives number and path twice."""
    number = getattr(error, "errno", None)
    return os.strerror(number) if number in (errno.ENOENT, errno.EACCES) else str(error)


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
