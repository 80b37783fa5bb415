# SPDX-License-Identifier: MIT
"""All watches together, as the estimator feeds them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ..config import EstimatorConfig
from ..hands.pads import PadSet

if TYPE_CHECKING:
    from ..estimate import Estimate
    from ..frame import Frame


class Watch:
    """Names the streams that contradict the others.

    Args:
        hand: The hand.
        config: The estimator's settings.
    """

    def __init__(self, hand: PadSet, config: EstimatorConfig) -> None:
        self._hand = hand

    def before(self, frame: Frame) -> Frame:
        """The frame, without what is known to be wrong before it is solved."""
        return frame

    def after(self, frame: Frame, estimate: Estimate) -> Estimate:
        """The estimate, with the faults that it shows."""
        return replace(estimate)
