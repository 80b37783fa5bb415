# SPDX-License-Identifier: MIT
"""What a solved frame knows: of the pose, and of each pad. One compiled call for all of it."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .compiled import compiled
from .covariance import all_held, covariance_of
from .factors import hand
from .factors.tactile import tactile_loss
from .handles import array1, array3
from .objective import Objective, linearize, linearize_hand
from .sdf.pad_pose import points_in_world
from .sdf.search import ALWAYS, NOT, closest_on_pads

REJECTED = 1e-3  # below this visual weight the visual pose pulls less than the damping holds
HELD = 1e-3  # a direction counts as held with this share of the best direction's information


class Conclusion(NamedTuple):
    """What is known where the solver ended.

    Attributes:
        visual_weight: What is left of the visual pose's weight after its robust loss; 0 where there is none.
        pad_distances: Signed distance of each pad to the object [m], shape (K,).
        pad_weights: How much each contact counts after its robust loss, 0 without contact, shape (K,).
        contact_points_w: Each pad's closest point in the world [m], shape (K, 3).
        covariance: Of the pose, see ``covariance_of``, shape (6, 6).
        held: Whether the hand's terms alone hold the pose in all directions; only where vision does not.
    """

    visual_weight: float
    pad_distances: np.ndarray
    pad_weights: np.ndarray
    contact_points_w: np.ndarray
    covariance: np.ndarray
    held: bool


def conclude(objective: Objective, T_wo: np.ndarray) -> Conclusion:
    """What is known with the object at T_wo (4, 4)."""
    points_p = objective.hand.closest.pads.points_p
    return Conclusion(*_conclude(T_wo, points_p, *objective.tables))


@compiled
def _conclude(T_wo: Any, points_p: Any, of_visual: Any, of_hand: Any, of_search: Any) -> Any:
    """The numbers of a ``Conclusion``."""
    information, gradient = np.empty((6, 6)), np.empty(6)
    _, visual_weight = linearize(T_wo, of_visual, of_hand, of_search, information, gradient)
    held = False
    if visual_weight < REJECTED:
        hand_alone = np.zeros((6, 6))
        linearize_hand(of_hand, hand_alone, np.zeros(6))
        held = all_held(hand_alone, HELD)

    T_wp, asked = array3(of_hand, hand.T_WP, np.float64), array1(of_hand, hand.ASKED, np.int8)
    distances = array1(of_hand, hand.DISTANCES, np.float64).copy()
    indices = array1(of_hand, hand.INDICES, np.int64).copy()
    weights = array1(of_hand, hand.WEIGHTS, np.float64)
    left, missing = np.zeros(len(asked)), np.full_like(asked, NOT)
    for k in range(len(asked)):
        if indices[k] < 0:
            missing[k] = ALWAYS
        if asked[k] == ALWAYS and weights[hand.TACTILE] > 0.0:
            _, left[k] = tactile_loss(distances[k], weights[hand.TACTILE], weights[hand.THETA])
    closest_on_pads(T_wo, T_wp, missing, distances, np.empty((len(asked), 6)), indices, of_search)
    points_w = points_in_world(T_wp, points_p, indices)
    return visual_weight, distances, left, points_w, covariance_of(information), held
