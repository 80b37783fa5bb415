# SPDX-License-Identifier: MIT
r"""The hand factor: the tactile and the penetration term of all pads, one row a pad.

A pad's closest point is either off the object, where the tactile term has a residual if the pad reports contact, or in
it, where the penetration term has one; never both. So one row a pad holds both terms, and GTSAM asks Python half as
often as with a factor for each.

One noise model cannot give some rows a Welsch loss and others none, so the losses are applied here, the way GTSAM's own
robust noise models do it: with e_k the weighted square of row k's residual r_k and rho_k its loss, the factor is

    sqrt(rho_k(e_k))                                     where GTSAM asks for the error, 1/2 sum rho_k(e_k),
    sqrt(rho'_k(e_k) w_k) (r_k + J_k xi)                 where it linearizes (iteratively reweighted least squares),

with J_k = dphi_k/dxi = [ (grad phi x p_o)^T  -grad phi^T ] for a right perturbation of T_wo, rotation first.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import gtsam
import numpy as np

from ..compiled import compiled, copy_matrix
from ..handles import Handles, array1, array2, array3
from ..sdf.closest import ClosestPoints, PadContacts
from ..sdf.search import ALWAYS, IF_INSIDE, closest_on_pads
from .checked import filled_factor
from .penetration import penetration_loss
from .tactile import tactile_loss


class HandWeights(NamedTuple):
    """Weights of the hand's terms, in the order of ``WEIGHTS``.

    Attributes:
        tactile: Weight of a touching pad's distance [1/m^2]; 0 leaves contacts out.
        penetration: Weight of a pad's depth [1/m^2]; 0 leaves penetration out.
        tactile_theta: Welsch's theta of the tactile term.
    """

    tactile: float
    penetration: float
    tactile_theta: float


class HandTerms:
    """The hand's terms at one object pose after another, each computed once however often it is asked for.

    Args:
        closest: Finds the pads' closest points.
        weights: The terms' weights.

    Attributes:
        contacts: The pads' closest points at the pose asked for last.
        losses: sqrt(rho_k) there, shape (K,).
        rows: Weighted residuals there, shape (K,).
        jacobians: Weighted Jacobians there, shape (K, 6).
        handles: All of it, for ``terms_at``.
    """

    def __init__(self, closest: ClosestPoints, weights: HandWeights) -> None:
        count = len(closest.pads)
        self.closest = closest
        self.contacts = PadContacts.room(count)
        self.losses, self.rows, self.jacobians = (
            np.zeros(count),
            np.zeros(count),
            np.zeros((count, 6)),
        )
        self._before = np.full((4, 4), np.nan)
        self.handles = Handles(
            self._before,
            np.array(weights),
            self.losses,
            self.rows,
            self.jacobians,
            closest.T_wp,
            closest.asked,
            *self.contacts,
        )

    def place(self, T_wp: np.ndarray, touching: np.ndarray) -> None:
        """Begin a frame: pad poses in the world, shape (K, 4, 4), and contact bits, bool, shape (K,)."""
        place_hand(T_wp, touching, self.handles.table)


# The arrays of ``HandTerms.handles``, in order: the pose that the terms are for, their weights, ...
BEFORE, WEIGHTS, LOSSES, ROWS, ROW_JACOBIANS, T_WP, ASKED, DISTANCES, JACOBIANS, INDICES = range(10)
TACTILE, PENETRATION, THETA = range(3)  # places in the weights


@compiled
def place_hand(T_wp: Any, touching: Any, terms: Any) -> None:
    """Begin a frame: see ``HandTerms.place``; ``terms`` is the table of ``HandTerms.handles``."""
    poses, asked = array3(terms, T_WP, np.float64), array1(terms, ASKED, np.int8)
    for k in range(len(asked)):
        copy_matrix(T_wp[k], poses[k])
        asked[k] = ALWAYS if touching[k] else IF_INSIDE
    array2(terms, BEFORE, np.float64)[0, 0] = np.nan


@compiled
def terms_at(T_wo: Any, terms: Any, search: Any) -> bool:
    """Make the terms those at the object pose T_wo (4, 4), unless they are already; whether they are finite.

    Args:
        T_wo: Object pose.
        terms: Table of ``HandTerms.handles``.
        search: Table of the search (see ``new_search``).
    """
    before = array2(terms, BEFORE, np.float64)
    same, finite = True, True
    for i in range(3):
        for j in range(4):
            same &= T_wo[i, j] == before[i, j]
            finite &= np.isfinite(T_wo[i, j])
    if same or not finite:
        return same
    copy_matrix(T_wo, before)
    asked = array1(terms, ASKED, np.int8)
    distances, jacobians = (
        array1(terms, DISTANCES, np.float64),
        array2(terms, JACOBIANS, np.float64),
    )
    indices, T_wp = array1(terms, INDICES, np.int64), array3(terms, T_WP, np.float64)
    closest_on_pads(T_wo, T_wp, asked, distances, jacobians, indices, search)
    losses, rows = array1(terms, LOSSES, np.float64), array1(terms, ROWS, np.float64)
    row_jacobians = array2(terms, ROW_JACOBIANS, np.float64)
    weights = array1(terms, WEIGHTS, np.float64)
    tactile, penetration, theta = weights[TACTILE], weights[PENETRATION], weights[THETA]
    for k in range(len(rows)):
        losses[k], rows[k] = 0.0, 0.0
        row_jacobians[k] = 0.0
        phi, scale = distances[k], 0.0
        if phi < 0.0:
            losses[k], scale = np.sqrt(penetration_loss(phi, penetration)), np.sqrt(penetration)
        elif phi > 0.0 and asked[k] == ALWAYS:
            loss, left = tactile_loss(phi, tactile, theta)
            losses[k], scale = np.sqrt(loss), np.sqrt(tactile * left)
        if scale > 0.0:
            rows[k] = scale * phi
            for j in range(6):
                row_jacobians[k, j] = scale * jacobians[k, j]
    return True


def hand_factor(key: int, terms: HandTerms) -> gtsam.CustomFactor:
    """Pull the object onto the pads that report contact, and push it out of all.

    Args:
        key: Key of the object pose T_wo.
        terms: The hand's terms, at the frame's pads.
    """
    of_terms, of_search = terms.handles.table, terms.closest.search.table
    held = terms.handles, terms.closest.search  # the arrays that the tables point to

    def fill(T_wo: np.ndarray, held: tuple[Handles, Handles] = held) -> bool:
        return terms_at(T_wo, of_terms, of_search)

    return filled_factor(key, fill, terms.losses, terms.rows, terms.jacobians)
