# SPDX-License-Identifier: MIT
"""The pad board, emulated byte by byte on a pseudo terminal, with faults on demand.

Any program that reads the real board reads this one by the name in ``path``. Forces come from a
callback, so that one simulated grasp can drive servos, pads and camera together.
"""

from __future__ import annotations

import os
import threading
import time
import tty
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hardware.tactile.frame import FULL_SCALE, Frame, encode
from hardware.tactile.wiring import PadWiring

from .pad_signal import PadSignal, in_parallel, pad_parameters

# Normal and shear force on each pad [N] at a time since the board started [s]: two arrays of shape
# (K,), in the order of the wiring's pads.
Forces = Callable[[float], tuple[np.ndarray, np.ndarray]]

_BANNER = b"Teensy 4.1\r\n"  # what a boot loader may print before the sketch runs


@dataclass
class PadFaults:
    """What goes wrong; may be changed while the board runs.

    Attributes:
        drop: Probability that a frame never leaves the board.
        corrupt: Probability that a bit of a frame flips.
        truncate: Probability that a frame loses its end.
        garbage: Probability that noise comes before a frame.
        silent: Nothing is sent.
        frozen: The same frame is sent again and again.
        opened: Inputs whose wire is off.
    """

    drop: float = 0.0
    corrupt: float = 0.0
    truncate: float = 0.0
    garbage: float = 0.0
    silent: bool = False
    frozen: bool = False
    opened: tuple[int, ...] = ()


class PadBoardEmulator:
    """An emulated pad board; a context manager.

    Attributes:
        path: Name of its serial port.
        faults: What goes wrong.
        sent: Frames made so far, those that a fault swallowed among them.
    """

    def __init__(
        self,
        wiring: PadWiring,
        signal: PadSignal,
        forces: Forces,
        rate: float = 50.0,
        seed: int = 0,
    ) -> None:
        """Open the port and begin to send.

        Args:
            wiring: The pads and their inputs.
            signal: How the pads answer to forces, in the order of the wiring's pads.
            forces: Where the forces come from; called from the board's own thread.
            rate: Frames a second [Hz].
            seed: Of the faults.
        """
        self.faults = PadFaults()
        self.sent = 0
        self._wiring = wiring
        self._signal = signal
        self._forces = forces
        self._period = 1.0 / rate
        self._rng = np.random.default_rng(seed)
        self._input_of = wiring.input_of(wiring.pad_names)
        self._sequence = 0
        self._started = time.monotonic()
        self._last = b""
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._stop = threading.Event()
        self._lock = threading.Lock()  # of the two file descriptors
        self._write(_BANNER + b"\0")
        self._thread = threading.Thread(target=self._run, name="emulated-pads", daemon=True)
        self._thread.start()

    def __enter__(self) -> PadBoardEmulator:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop sending and take the port away."""
        self._stop.set()
        self._thread.join()
        self.unplug()

    def unplug(self) -> None:
        """Pull the cable: the port is gone, the board runs on."""
        with self._lock:
            for descriptor in (self._master, self._slave):
                if descriptor >= 0:
                    os.close(descriptor)
            self._master = self._slave = -1

    def restart(self) -> None:
        """Let the board boot again: a banner, and sequence and clock from zero."""
        with self._lock:
            self._sequence = 0
            self._started = time.monotonic()
        self._write(_BANNER + b"\0")

    def _run(self) -> None:
        deadline = time.monotonic()
        while not self._stop.wait(max(0.0, deadline - time.monotonic())):
            deadline += self._period
            self._tick()

    def _tick(self) -> None:
        with self._lock:
            elapsed, sequence = time.monotonic() - self._started, self._sequence
            self._sequence = (sequence + 1) % 2**16
        if not (self.faults.frozen and self._last):
            frame = Frame(sequence, int(elapsed * 1e6) % 2**32, self._readings(elapsed))
            self._last = encode(frame)
        self.sent += 1
        if not self.faults.silent:
            self._write(self._damage(self._last))

    def _readings(self, elapsed: float) -> tuple[int, ...]:
        """The board's converter: each input's share of the supply voltage, in whole steps."""
        normal, shear = self._forces(elapsed)
        pads = self._signal.step(normal, shear, self._period)
        resistance = in_parallel(pads, self._input_of, len(self._wiring.inputs))
        share = resistance / (resistance + self._wiring.reference_ohm)
        readings = np.rint(share * FULL_SCALE).astype(int)
        readings[list(self.faults.opened)] = FULL_SCALE
        return tuple(readings.tolist())

    def _damage(self, data: bytes) -> bytes:
        faults, chance = self.faults, self._rng.random(4)
        if chance[0] < faults.drop:
            return b""
        if chance[1] < faults.corrupt:
            bit = int(self._rng.integers(8 * len(data)))
            damaged = bytearray(data)
            damaged[bit // 8] ^= 1 << bit % 8
            data = bytes(damaged)
        if chance[2] < faults.truncate:
            data = data[: int(self._rng.integers(len(data)))]
        if chance[3] < faults.garbage:
            data = self._rng.bytes(int(self._rng.integers(1, 30))) + data
        return data

    def _write(self, data: bytes) -> None:
        with self._lock:
            if self._master < 0:
                return
            try:
                os.write(self._master, data)
            except BlockingIOError:
                pass  # nobody reads; a real board's bytes are lost as well


_FORCE = 6.0  # [N]
_FIRST, _LAST = 1.0, 4.0  # [s] after Enter: pressed in between


class PadPresser:
    """An emulated pad board with somebody to press it; a context manager.

    Attributes:
        path: The board's port.
    """

    def __init__(self, wiring: PadWiring, say: Callable[[str], None], seed: int = 0) -> None:
        """Begin with nothing touched.

        Args:
            wiring: The pads.
            say: Shows what is done.
            seed: As of a ``Rig``, whose pads are then the same.
        """
        self._names = wiring.pad_names
        self._say = say
        self._pad: int | None = None
        self._asked = 0.0
        pads = np.random.SeedSequence(seed).spawn(2)[0]
        signal = PadSignal(pad_parameters(wiring, pads), np.random.default_rng(pads))
        self._board = PadBoardEmulator(wiring, signal, self._forces)
        self.path = self._board.path

    def __enter__(self) -> PadPresser:
        return self

    def __exit__(self, *exception: object) -> None:
        self._board.close()

    def answer(self, question: str) -> str:
        """Do what is asked, and press Enter."""
        self._say(question)
        named = [k for k, name in enumerate(self._names) if f"] {name}:" in question]
        self._pad = named[0] if named else None
        self._asked = time.monotonic()
        return ""

    def _forces(self, elapsed: float) -> tuple[np.ndarray, np.ndarray]:
        normal = np.zeros(len(self._names))
        if self._pad is not None and _FIRST < time.monotonic() - self._asked < _LAST:
            normal[self._pad] = _FORCE
        return normal, np.zeros_like(normal)
