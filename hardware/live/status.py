# SPDX-License-Identifier: MIT
"""How a run goes, in one line, and how it went, in a few."""

from __future__ import annotations

import sys
import time
from typing import TextIO

import numpy as np

from vtgtsam.live.clock import RunClock
from vtgtsam.live.fusion import Fusion
from vtgtsam.live.inputs import Inputs
from vtgtsam.live.rate import Rate
from vtgtsam.live.verdict import in_words

from .ages import ages, stale
from .fingers import Fingers
from .sensors import Vision

_TERMINAL_PERIOD, _PLAIN_PERIOD = 0.2, 2.0  # [s], between lines
_SHOWN = ("joints", "pads", "images", "fusion")


class Status:
    """The status of a run.

    Args:
        inputs: Its streams.
        fusion: Its estimator.
        fingers: Its servos.
        vision: Its camera and tracker.
        clock: The run's clock.
        out: Where the line goes; on a terminal it is written over.

    Attributes:
        last_line: The line as it was shown last.
        remarks: What people should hear after the run; a line each.
    """

    def __init__(
        self,
        inputs: Inputs,
        fusion: Fusion,
        fingers: Fingers,
        vision: Vision,
        clock: RunClock,
        out: TextIO = sys.stdout,
    ) -> None:
        self._inputs = inputs
        self._fusion = fusion
        self._fingers = fingers
        self._vision = vision
        self._clock = clock
        self._out = out
        self._rates = {name: Rate() for name in _SHOWN}
        self._began = time.monotonic()
        self._first = {name: self._count(name) for name in _SHOWN}
        self._shown = -np.inf
        self._seconds = 0.0
        self.last_line = ""
        self.remarks: list[str] = []

    def show(self) -> None:
        """Write the line, if it is time to."""
        now = time.monotonic()
        terminal = self._out.isatty()
        if now - self._shown >= (_TERMINAL_PERIOD if terminal else _PLAIN_PERIOD):
            self._shown = now
            end = "\x1b[K\r" if terminal else "\n"
            self.last_line = self.line()
            self._out.write(self.last_line + end)
            self._out.flush()

    def end(self) -> None:
        """The run is over: stop its watch, and leave the line as it is."""
        self._seconds = time.monotonic() - self._began
        if self._out.isatty():
            self._out.write("\n")

    def line(self) -> str:
        """Time, state, rate and age of each stream, contacts, and what is wrong."""
        now, now_ns = time.monotonic(), self._clock.now_ns()
        parts = [f"{now - self._began:5.1f} s {self._fingers.phase.value}"]
        for name in _SHOWN:
            text = f"{name} {self._rates[name].update(now, self._count(name)):.0f} Hz"
            if name != "fusion":
                text += f" {1000 * self._age(name, now_ns):.0f} ms"
            parts.append(text)
        return " | ".join([*parts, self._contacts(), self._warmest(), self._pose(now_ns)])

    def summary(self) -> list[str]:
        """Rates over the whole run, what was left out, latencies."""
        rates = ", ".join(
            f"{name} {(self._count(name) - self._first[name]) / max(self._seconds, 1e-9):.1f} Hz"
            for name in _SHOWN
        )
        ticker = self._fingers.ticker
        refused = {"joints": "joints", "pads": "contacts", "visual poses": "vision"}
        late = ", ".join(
            f"{count} {name}"
            for name, stream in refused.items()
            if (count := self._inputs.refused(stream))
        )
        return [
            f"{self._fusion.count} poses in {self._seconds:.1f} s: {rates}",
            f"left out: {ticker.missed} of {ticker.ticks + ticker.missed} servo cycles, fingers "
            f"waited {self._fingers.waits} times, object not seen in {self._vision.lost} images, "
            f"not newer than the one before: {late or 'nothing'}",
            *self._fusion.latencies.lines(),
            *(f"note: {remark}" for remark in self.remarks),
        ]

    def _count(self, name: str) -> int:
        if name in ("images", "fusion"):
            return self._vision.images if name == "images" else self._fusion.count
        return self._inputs.count("contacts" if name == "pads" else name)

    def _age(self, name: str, now_ns: int) -> float:
        if name != "images":
            return ages(self._inputs, now_ns)[name]
        image_ns = self._vision.image_ns
        return np.inf if image_ns is None else (now_ns - image_ns) / 1e9

    def _contacts(self) -> str:
        contacts = self._inputs.contacts_at(self._clock.now_ns())
        if contacts is None:
            return "no pads"
        return f"contacts {np.count_nonzero(contacts)}/{len(contacts)}"

    def _warmest(self) -> str:
        state = self._fingers.state
        if state is None or np.isnan(state.temperatures).all():
            return ""
        return f"{np.nanmax(state.temperatures):.0f} °C, {np.nanmin(state.voltages):.1f} V"

    def _pose(self, now_ns: int) -> str:
        late = ", ".join(stale(ages(self._inputs, now_ns)))
        estimate = self._fusion.last
        verdict = "no visual pose yet" if estimate is None else in_words(estimate)
        if self._vision.trouble:
            return f"{verdict}, from touch alone ({self._vision.trouble})"
        return f"{verdict}, {late} too old" if late else verdict
