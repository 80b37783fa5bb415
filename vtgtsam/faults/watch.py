# SPDX-License-Identifier: MIT
"""All watches together, as the estimator feeds them: before a frame is solved, and after."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..config import EstimatorConfig
from ..frame import Frame
from ..hands.pads import PadSet
from ..sdf.grid import GridSdf
from .events import Event, EventWatch
from .hand import HandWatch
from .lasting import Lasting
from .pads import PadWatch
from .vision import VisionWatch
from .words import CONTACTS_INVERTED

if TYPE_CHECKING:
    from ..calibration.change import Change
    from ..estimate import Estimate, Status

CONTRADICTED = 0.2  # [s], a frame or two of noise contradict nothing
REJECTED = 0.1  # a contact that counts less is rejected


class Watch:
    """Names the streams that contradict the others.

    Args:
        hand: The hand.
        sdf: The object's distance field.
        config: The estimator's settings.
    """

    def __init__(self, hand: PadSet, sdf: GridSdf, config: EstimatorConfig) -> None:
        self._config = config
        self._touching = np.zeros(len(hand), dtype=bool)
        self._vision = VisionWatch(sdf)
        self._hand = HandWatch(hand)
        self._pads = PadWatch(hand.pad_names)
        self._events = EventWatch()
        self._contradicted = Lasting(CONTRADICTED)
        self._inverted = False  # in the last frame

    def recalibrate(self, change: Change) -> None:
        """Have seen everything with another calibration."""
        self._vision.recalibrate(change)
        self._hand.recalibrate(change)

    def before(self, frame: Frame) -> Frame:
        """The frame, without what is known to be wrong before it is solved."""
        self._touching = frame.touching  # as the pads say
        if self._inverted:  # whatever they say is not what touches
            frame = frame._replace(touching=np.zeros_like(frame.touching))
        frame, of_vision = self._vision.before(frame)
        frame, of_hand = self._hand.before(frame, self._vision.jumped_lately(frame.time))
        return frame._replace(faults=(*frame.faults, *of_vision, *of_hand))

    def after(self, frame: Frame, estimate: Estimate) -> Estimate:
        """The estimate with its faults and events, its status in view of them."""
        if estimate.T_wo is None or not self._config.memory:
            return estimate
        refused = frame.T_ho_visual is not None and (
            estimate.visual_weight < self._config.refused_weight
        )
        faults = [*estimate.faults]
        if frame.pads_known:
            points_h = frame.T_wh.transformTo(estimate.contact_points_w.T).T
            faults += self._vision.after(frame, refused, frame.touching, points_h)
        believed = estimate.status == "ok"
        faults += self._pads.after(
            frame.time, self._touching, estimate.pad_distances, believed and frame.pads_known
        )
        self._inverted = CONTACTS_INVERTED in faults
        events: tuple[Event, ...] = ()
        if estimate.mode is not None:
            T_ho = frame.T_wh.between(estimate.T_wo)
            events = self._events.after(frame.time, estimate.mode, T_ho)
        status = self._status(frame, estimate, refused)
        return replace(estimate, faults=tuple(faults), events=events, status=status)

    def _status(self, frame: Frame, estimate: Estimate, refused: bool) -> Status:
        weights = estimate.pad_weights[frame.touching]
        denied = len(weights) > 1 and frame.pads_known and bool((weights < REJECTED).all())
        against = denied or self._inverted or (refused and estimate.mode == "held")
        contradicted = self._contradicted.holds(frame.time, against)
        return "contradicted" if contradicted and estimate.status == "ok" else estimate.status
