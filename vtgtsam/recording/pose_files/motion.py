# SPDX-License-Identifier: MIT
"""How well poses follow an object whose motion is known, at one choice of instants or another.

What is compared are a few points of the object: where the pose has them and where the reference has them,
in the object's own frame. Wrong instants, unlike a wrong mesh origin, show only while the object moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import gtsam
import numpy as np

from ...objects import ObjectModel

MOST_POSES = 400  # that are compared
FEWEST = 3  # poses that can tell two choices apart
SHARE = (
    0.1  # of the largest difference between two choices, from which on a pose can tell them apart
)
LEAST = 2e-4  # [m], a choice that moves the object by less is the same one
PIECES = 12  # of a recording, each with an error of its own
DEVIATIONS = 3.0  # standard errors that make a difference clear
LEAST_ERROR = 0.05  # of the share below, for a few poses may agree by chance


@dataclass(frozen=True, eq=False)
class Points:
    """Points of the object at several poses.

    Attributes:
        rotations: Of the poses, shape (N, 3, 3); NaN where there is no pose.
        translations: Of the poses [m], shape (N, 3).
    """

    rotations: np.ndarray
    translations: np.ndarray

    @classmethod
    def of(cls, poses: Sequence[gtsam.Pose3 | None]) -> Points:
        """Take poses, None where there is none."""
        matrices = np.array([np.full((4, 4), np.nan) if T is None else T.matrix() for T in poses])
        matrices = matrices.reshape(-1, 4, 4)
        return cls(matrices[:, :3, :3], matrices[:, :3, 3])

    def __getitem__(self, index: np.ndarray) -> Points:
        return Points(self.rotations[index], self.translations[index])


def tracked_points(obj: ObjectModel) -> np.ndarray:
    """Points that any tracker of the object follows [m], shape (J, 3): on the axis of what looks the same turned."""
    extents = obj.sdf.upper - obj.sdf.lower if obj.mesh is None else obj.mesh.extents
    radius = float(np.max(extents)) / 2
    symmetry = obj.symmetry or {}
    axes = [np.asarray(a["axis"], float) for a in symmetry.get("symmetries_continuous", [])]
    if len(axes) > 1 or symmetry.get("symmetries_discrete"):
        return np.asarray(obj.center[None])
    if axes:
        axis = axes[0] / np.linalg.norm(axes[0])
        return np.stack([obj.center - radius * axis, obj.center + radius * axis])
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3)
    return np.asarray(obj.center + radius * corners)


def places(poses: Points, reference: Points, points_o: np.ndarray) -> np.ndarray:
    """Where poses have the points, in the frame of the object at the reference [m], shape (N, J, 3)."""
    moved = np.einsum("nij,kj->nki", poses.rotations, points_o)
    moved = moved + (poses.translations - reference.translations)[:, None]
    places_o: np.ndarray = np.einsum("nji,nkj->nki", reference.rotations, moved)
    return places_o


def squared_errors(places_o: np.ndarray, expected_o: np.ndarray) -> np.ndarray:
    """Mean squared distance of each pose's points to where they are expected [m^2], shape (N,)."""
    squared: np.ndarray = np.mean(np.sum((places_o - expected_o) ** 2, axis=2), axis=1)
    return squared


@dataclass(frozen=True, eq=False)
class Fit:
    """How well poses follow a reference at one choice of instants.

    Attributes:
        poses: The N poses.
        reference: The reference at those instants.
        plain: Squared errors of the poses as they are [m^2], shape (N,).
        centred: The same without what is constant in the object's frame, a mesh with another origin.
    """

    poses: Points
    reference: Points
    plain: np.ndarray
    centred: np.ndarray

    @classmethod
    def of(cls, poses: Points, reference: Points, points_o: np.ndarray) -> Fit:
        """Compare poses with a reference at as many instants."""
        found = places(poses, reference, points_o)
        known = np.isfinite(found).all(axis=(1, 2))
        middle = np.median(found[known], axis=0) if known.any() else points_o
        return cls(poses, reference, squared_errors(found, points_o), squared_errors(found, middle))

    @property
    def score(self) -> float:
        """Root mean square of the centred errors [m]; inf where fewer than half the poses can be judged."""
        known = np.isfinite(self.centred)
        if 2 * known.sum() < len(known):
            return float("inf")
        return float(np.sqrt(np.mean(self.centred[known])))

    @property
    def error(self) -> float:
        """Root mean square error of the poses as they are [m]."""
        return float(np.sqrt(np.nanmean(self.plain)))


def clearly_better(a: Fit, b: Fit, points_o: np.ndarray, centred: bool) -> bool:
    r"""Whether poses follow the object at the instants of ``a`` and not at those of ``b``, beyond chance.

    With m_i where the object is at a's instants and e_i where the poses have it, both as seen from where it
    is at b's, the poses are e_i = lambda m_i + noise with lambda = 1 if a is right and 0 if b is:

        lambda = sum m_i e_i / sum m_i^2

    Its standard error comes from the sums over a dozen pieces of the recording, since a tracker's error
    lasts for many images.

    Args:
        a: One choice of instants.
        b: Another, for the same poses.
        points_o: The points that were compared [m], shape (J, 3).
        centred: Whether it must hold without what is constant in the object's frame, too.
    """
    moved = places(a.reference, b.reference, points_o) - points_o
    found = places(a.poses, b.reference, points_o) - points_o
    known = np.isfinite(moved).all(axis=(1, 2)) & np.isfinite(found).all(axis=(1, 2))
    if not known.any():
        return False
    m, e = moved[known], found[known]
    ways = [(m, e), (m - m.mean(axis=0), e - e.mean(axis=0))] if centred else [(m, e)]
    return all(_follows(*way) for way in ways)


def _follows(moved: np.ndarray, found: np.ndarray) -> bool:
    """Whether what was found (N, J, 3) is what moved, rather than nothing."""
    lengths = np.sqrt(np.mean(np.sum(moved**2, axis=2), axis=1))
    telling = lengths > max(SHARE * float(lengths.max()), LEAST)
    if telling.sum() < FEWEST:
        return False
    m, e = moved[telling], found[telling]
    total = float(np.sum(m**2))
    share = float(np.sum(m * e)) / total
    rest = np.sum(m * (e - share * m), axis=(1, 2))
    error = np.sqrt(sum(float(piece.sum()) ** 2 for piece in np.array_split(rest, PIECES))) / total
    return bool(share - 0.5 > DEVIATIONS * max(float(error), LEAST_ERROR))
