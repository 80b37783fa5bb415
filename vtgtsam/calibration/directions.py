# SPDX-License-Identifier: MIT
r"""Which offsets grasps have shown, and which grasps would show the others.

An offset by itself is the wrong question: contacts see sums of joint zeros, and the camera along with them. So it is
asked of directions, the eigenvectors of the posterior in units of what was believed before, L^-1 P L^-T with P0 = L L':
an eigenvalue near 1 is a direction of which nothing was learnt.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..hands.model import HandModel

CAMERA = ("camera turn x", "camera turn y", "camera turn z", "camera x", "camera y", "camera z")
NOTHING = 0.05  # information of an offset below this, in units of what was believed before, is nothing learnt
UNSEEN = 0.9  # share of the standard deviation believed before that is left of a direction that was not seen
PART = 0.35  # of the largest component, smaller ones are not named
MOST_NAMES = 4  # in a direction's name
SELDOM = 0.05  # share of the busiest pad's touches, below which a pad seldom touches


class Direction(NamedTuple):
    """A combination of offsets.

    Attributes:
        components: In units of what was believed before, shape (6 + J,), norm 1.
        left: Share of its standard deviation that is left, in [0, 1].
    """

    components: np.ndarray
    left: float


def directions(covariance: np.ndarray, before: np.ndarray) -> list[Direction]:
    """Independent directions, the least known one first.

    Args:
        covariance: The posterior, shape (N, N).
        before: What was believed before the first grasp, shape (N, N).
    """
    sigmas = np.sqrt(np.diag(before))
    scaled = covariance / np.outer(sigmas, sigmas)
    correlation = before / np.outer(sigmas, sigmas)
    L = np.linalg.cholesky(correlation)
    inverse = np.linalg.inv(L)
    eigenvalues, vectors = np.linalg.eigh(inverse @ scaled @ inverse.T)
    found = []
    for value, vector in zip(eigenvalues[::-1], vectors.T[::-1], strict=True):
        components = L @ vector
        components /= np.linalg.norm(components)
        found.append(Direction(components, float(np.sqrt(np.clip(value, 0.0, 1.0)))))
    return found


def unseen(
    covariance: np.ndarray, before: np.ndarray, hand: HandModel, touches: np.ndarray
) -> tuple[str, ...]:
    """A sentence for each direction that was not seen: what it is, and which grasps would show it.

    Args:
        covariance: The posterior, shape (6 + J, 6 + J).
        before: What was believed before the first grasp, of that shape too.
        hand: The hand.
        touches: In how many keyframes each pad touched, shape (K,).
    """
    names = [*CAMERA, *hand.joint_names]
    learnt = np.diag(np.linalg.inv(covariance) - np.linalg.inv(before)) * np.diag(before)
    (idle,), (seen,) = np.nonzero(learnt < NOTHING), np.nonzero(learnt >= NOTHING)
    sentences = []
    if len(idle):
        what = ", ".join(names[i] for i in idle)
        sentences.append(f"{what}: nothing was learnt; {_remedy(idle, hand, touches)}")
    if not len(seen):
        return tuple(sentences)
    part = np.ix_(seen, seen)
    for direction in directions(covariance[part], before[part]):
        if direction.left < UNSEEN:
            break
        components = np.zeros(len(names))
        components[seen] = direction.components
        chosen = _largest(components)
        sentences.append(
            f"{_named(components, chosen, names)}: {direction.left:.0%} of what was believed before is left; "
            f"{_remedy(chosen, hand, touches)}"
        )
    return tuple(sentences)


def _largest(components: np.ndarray) -> np.ndarray:
    """Which components a direction is named by, the largest first."""
    order = np.argsort(-np.abs(components))
    enough = np.abs(components[order]) >= PART * np.abs(components).max()
    largest: np.ndarray = order[enough][:MOST_NAMES]
    return largest


def _named(components: np.ndarray, chosen: np.ndarray, names: Sequence[str]) -> str:
    """The direction in words, "index_middle - 0.8 index_distal"."""
    words = str(names[chosen[0]])
    for i in chosen[1:]:
        share = components[i] / components[chosen[0]]
        words += f" {'+' if share > 0 else '-'} {abs(share):.1f} {names[i]}"
    return words


def _remedy(offsets: np.ndarray, hand: HandModel, touches: np.ndarray) -> str:
    """Which grasps would show some offsets, given by their places."""
    joints = offsets[offsets >= 6] - 6
    if not len(joints):
        return "grasps that touch the palm, with the hand turned far in between, would show it"
    moved = np.any(hand.moves_pads[:, joints], axis=1)
    seldom = moved & np.less_equal(touches, SELDOM * touches.max(initial=0))
    pads = ", ".join(
        name
        for name, yes in zip(hand.pad_names, seldom if seldom.any() else moved, strict=True)
        if yes
    )
    if not pads:
        return "no pad moves with it, so it does not matter"
    if seldom.any():
        return f"grasps in which {pads} touch would show it"
    return f"grasps that bend these joints otherwise while {pads} touch would show it"
