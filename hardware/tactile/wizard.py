# SPDX-License-Identifier: MIT
"""Walks a person through the bench calibration of the pads (``calibrate-pads``)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .pressure import (
    BASELINE_SECONDS,
    PadCalibrationError,
    PadScale,
    drop_under_press,
    measure_baseline,
)
from .wiring import PadWiring

PRESS_SECONDS = 5.0


@dataclass(frozen=True)
class PadWizard:
    """The bench calibration as a conversation.

    Attributes:
        wiring: The pads of the hand; disabled ones are left out.
        sample: Resistances of all inputs over that many seconds from now [ohm], shape (T, N).
        ask: Shows a question and returns what the person types.
        say: Shows a line.
    """

    wiring: PadWiring
    sample: Callable[[float], np.ndarray]
    ask: Callable[[str], str]
    say: Callable[[str], None]

    def run(self) -> PadScale:
        """Measure the untouched resistance of each input and its fall under 6 N.

        Returns:
            The scale; the fall is NaN for inputs of which the person skipped a pad.

        Raises:
            PadCalibrationError: The person gave up.
        """
        pads = self._pads()
        self.say(
            f"Calibration of {len(pads)} pads. You need something that presses with 6 N, such as a "
            "force gauge, or a weight of 612 g on a round rubber tip. 's' skips a pad, 'q' gives up."
        )
        baseline = self._baseline()
        # Pads in parallel share one scale: the less sensitive one's, so that it too reaches 1.
        drop = np.full(len(self.wiring.inputs), np.inf)
        for number, (index, name) in enumerate(pads, start=1):
            fall = self._press(f"[{number}/{len(pads)}] {name}", index, baseline)
            drop[index] = np.minimum(drop[index], fall)  # NaN, of a skipped pad, stays
        drop[np.isinf(drop)] = np.nan
        self._report_skipped(drop)
        return PadScale(baseline=baseline, drop=drop)

    def _pads(self) -> list[tuple[int, str]]:
        """The pads to press, each with its input."""
        return [
            (index, name)
            for index, entry in enumerate(self.wiring.inputs)
            for name in entry.pads
            if name not in self.wiring.disabled
        ]

    def _baseline(self) -> np.ndarray:
        while True:
            self._answer("Take everything off the hand and do not touch it. Then press Enter: ")
            try:
                return measure_baseline(self.sample(BASELINE_SECONDS), self.wiring)
            except PadCalibrationError as error:
                self.say(f"{error}.")

    def _press(self, title: str, index: int, baseline: np.ndarray) -> float:
        """Fall of the input's resistance under 6 N [ohm], or NaN if the person skips the pad."""
        while True:
            question = f"{title}: press Enter, then press the pad's middle with 6 N for 3 s: "
            if self._answer(question) == "s":
                return np.nan
            try:
                fall = drop_under_press(self.sample(PRESS_SECONDS), baseline, index, self.wiring)
            except PadCalibrationError as error:
                self.say(f"{error}. Once more, or 's' to skip it.")
            else:
                self.say(
                    f"  {baseline[index]:.0f} ohm, {fall / baseline[index]:.0%} less under 6 N"
                )
                return fall

    def _answer(self, question: str) -> str:
        answer = self.ask(question).strip().lower()
        if answer == "q":
            raise PadCalibrationError("the calibration was given up, nothing is saved")
        return answer

    def _report_skipped(self, drop: np.ndarray) -> None:
        skipped = [name for index, name in self._pads() if np.isnan(drop[index])]
        if skipped:
            names = ", ".join(skipped)
            self.say(f"Skipped; list them under 'disabled' in the hand's file: {names}")
