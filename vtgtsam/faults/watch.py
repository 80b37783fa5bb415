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
from .fit import FitWatch
from .hand import HandWatch
from .inversion import InversionWatch
from .lasting import Lasting
from .pads import PadWatch
from .vision import VisionWatch
from .words import CONTACTS_INVERTED, NO_FIT, VISION_FAR

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
        self._given: Frame  # as it came, but for what is wrong with it alone
        self._vision = VisionWatch(sdf)
        self._hand = HandWatch(hand)
        self._pads = PadWatch(hand.pad_names)
        self._fit = FitWatch(hand, sdf)
        self._events = EventWatch()
        self._inversion = InversionWatch()
        self._contradicted = Lasting(CONTRADICTED)

    def recalibrate(self, change: Change) -> None:
        """Have seen everything with another calibration."""
        self._vision.recalibrate(change)
        self._hand.recalibrate(change)

    def before(self, frame: Frame) -> Frame:
        """The frame, without what is known to be wrong before it is solved.

        A method without memory is told of what is wrong with one frame by itself.
        """
        frame = self._alone(frame)
        self._given = frame
        if not self._config.memory:
            return frame
        if self._inversion.before(frame.touching):  # whatever they say is not what touches
            frame = frame._replace(touching=np.zeros_like(frame.touching))
        if self._fit.misfit:  # what its pads say is about another object
            frame = frame.without_pads()
        frame, of_vision = self._vision.before(frame)
        frame, of_hand = self._hand.before(frame, self._vision.jumped_lately(frame.time))
        faults = (*frame.faults, *of_vision, *of_hand)
        return frame._replace(faults=faults, suspect=self._vision.suspect)

    def _alone(self, frame: Frame) -> Frame:
        frame, of_vision = self._vision.alone(frame)
        frame, of_hand = self._hand.alone(frame)
        return frame._replace(faults=(*frame.faults, *of_vision, *of_hand))

    def after(self, frame: Frame, estimate: Estimate) -> Estimate:
        """The estimate with its faults and events, its status in view of them."""
        if estimate.T_wo is None or not self._config.memory:
            return estimate
        refused = frame.T_ho_visual is not None and (
            estimate.visual_weight < self._config.refused_weight
        )
        believed = estimate.status == "ok" and frame.pads_known
        faults = [*estimate.faults]
        if frame.pads_known:
            points_h = frame.T_wh.transformTo(estimate.contact_points_w.T).T
            faults += self._vision.after(frame, refused, frame.touching, points_h)
        faults += self._of_pads(frame.time, estimate.pad_distances, believed)
        doubt = 1.0 if self._vision.suspect else estimate.visual_weight
        seen = self._given._replace(T_ho_visual=frame.T_ho_visual)
        if self._fit.after(seen, doubt, estimate.pad_distances):
            faults = [fault for fault in faults if fault not in (VISION_FAR, NO_FIT)] + [NO_FIT]
        events: tuple[Event, ...] = ()
        if estimate.mode is not None and not self._contacts_wrong:
            T_ho = frame.T_wh.between(estimate.T_wo)
            touching = int(np.count_nonzero(frame.touching))
            events = self._events.after(
                frame.time, estimate.mode, touching, T_ho, estimate.covariance
            )
        status = self._status(frame, estimate, refused)
        return replace(estimate, faults=tuple(faults), events=events, status=status)

    @property
    def _contacts_wrong(self) -> bool:
        """Whether contacts are left out, so that they say nothing of what the hand does."""
        return self._inversion.inverted or self._fit.misfit

    def _of_pads(self, time: float, distances: np.ndarray, believed: bool) -> tuple[str, ...]:
        if self._inversion.after(time, self._given.touching, distances, believed):
            return (CONTACTS_INVERTED,)
        return self._pads.after(time, self._given.touching, distances, believed)

    def _status(self, frame: Frame, estimate: Estimate, refused: bool) -> Status:
        weights = estimate.pad_weights[frame.touching]
        denied = len(weights) > 1 and frame.pads_known and bool((weights < REJECTED).all())
        against = (
            denied
            or self._inversion.inverted
            or self._fit.misfit
            or (refused and estimate.mode == "held")
        )
        contradicted = self._contradicted.holds(frame.time, against)
        return "contradicted" if contradicted and estimate.status == "ok" else estimate.status
