# SPDX-License-Identifier: MIT
"""A frame's cost and its linearization at one object pose after another, compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from .compiled import compiled
from .config import EstimatorConfig
from .factors import hand, visual
from .factors.hand import HandTerms, HandWeights, terms_at
from .factors.noise import sqrt_information, theta
from .factors.visual import VisualTerm, visual_loss, visual_rows
from .frame import Frame
from .handles import array1, array2
from .hands.pads import PadSet
from .objects import ObjectModel
from .sdf.closest import ClosestPoints


class Objective:
    """A frame's terms: the visual one and the hand's.

    Args:
        pads: The hand's pads.
        obj: The object.
        config: Method, weights and losses.

    Attributes:
        hand: The hand's terms.
        visual: The visual term.
    """

    def __init__(self, pads: PadSet, obj: ObjectModel, config: EstimatorConfig) -> None:
        self.hand = HandTerms(ClosestPoints(pads, obj.sdf), hand_weights(config))
        self.visual = VisualTerm(theta(config.log_theta_vis))
        self._whitening = sqrt_information(*config.visual_weights)

    @property
    def tables(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of the visual term, the hand's terms and their search, for the functions below."""
        terms = self.hand
        return self.visual.handles.table, terms.handles.table, terms.closest.search.table

    def place(self, frame: Frame) -> None:
        """Begin a frame."""
        whitening = frame.visual_whitening
        self.hand.place(frame.T_wp, frame.touching)
        self.visual.place(frame.visual_matrix, self._whitening if whitening is None else whitening)


def hand_weights(config: EstimatorConfig) -> HandWeights:
    """The weights of the hand's terms that a method has."""
    return HandWeights(
        tactile=config.w_tac if config.method == "vis+tac+pen" else 0.0,
        penetration=0.0 if config.method == "vis" else config.w_pen,
        tactile_theta=theta(config.log_theta_tac),
    )


@compiled
def cost(T_wo: Any, of_visual: Any, of_hand: Any, of_search: Any) -> float:
    """The cost 1/2 sum rho at T_wo (4, 4); infinite where that is not finite."""
    if not terms_at(T_wo, of_hand, of_search):
        return np.inf
    total = visual_loss(T_wo, of_visual)
    losses = array1(of_hand, hand.LOSSES, np.float64)
    for k in range(len(losses)):
        total += losses[k] * losses[k]
    return 0.5 * total


@compiled
def linearize(
    T_wo: Any, of_visual: Any, of_hand: Any, of_search: Any, information: Any, gradient: Any
) -> Any:
    """J'WJ into ``information`` (6, 6) and -J'Wr into ``gradient`` (6,) at T_wo (4, 4).

    Returns:
        The cost of the linear model, 1/2 r'Wr, and the visual term's weight rho'(e).
    """
    information[:] = 0.0
    gradient[:] = 0.0
    terms_at(T_wo, of_hand, of_search)
    visual_weight = visual_rows(T_wo, of_visual)
    model = _add_rows(
        array1(of_visual, visual.ROWS, np.float64),
        array2(of_visual, visual.ROW_JACOBIANS, np.float64),
        information,
        gradient,
    )
    model += linearize_hand(of_hand, information, gradient)
    return model, visual_weight


@compiled
def linearize_hand(of_hand: Any, information: Any, gradient: Any) -> float:
    """Add what the hand's terms contribute at the pose they were computed for last; returns their 1/2 r'Wr."""
    return _add_rows(
        array1(of_hand, hand.ROWS, np.float64),
        array2(of_hand, hand.ROW_JACOBIANS, np.float64),
        information,
        gradient,
    )


@compiled
def _add_rows(rows: Any, jacobians: Any, information: Any, gradient: Any) -> float:
    """Add J'J and -J'r of rows r (N,) and their Jacobian (N, 6); returns 1/2 r'r."""
    total = 0.0
    for n in range(len(rows)):
        total += rows[n] * rows[n]
        for i in range(6):
            gradient[i] -= jacobians[n, i] * rows[n]
            for j in range(6):
                information[i, j] += jacobians[n, i] * jacobians[n, j]
    return 0.5 * total
