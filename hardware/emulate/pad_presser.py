# SPDX-License-Identifier: MIT
"""A pad board and the person who presses its pads one after another when asked to."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from hardware.tactile.wiring import PadWiring

from .pad_signal import PadSignal
from .pads import PadBoardEmulator
from .rig import pad_parameters

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
