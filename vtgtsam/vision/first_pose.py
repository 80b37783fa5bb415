# SPDX-License-Identifier: MIT
"""Find an object in a depth image without knowing where it was before.

    many orientations, each put where its surface lies on the points seen  ->  aligned  ->  scored
    the best of them, turned about the object's axes  ->  aligned  ->  scored
    the best of all, with more pixels

The first steps of an alignment pretend that the image is noisier than it is: so a pose that is off by a few
centimetres is still drawn to the points. One view may leave several answers, such as a box of which one side is
seen; so the best poses are returned, and whoever asked has to judge whether the first is good and alone.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import gtsam
import numpy as np

from .alignment import Evidence, Shape, align, outline_pixels, stride
from .view import View

ORIENTATIONS = 300  # about 32 degrees from each to the next
TRIED = 50  # of those, how many are aligned
KEPT = 12  # of those, how many are aligned with more pixels
COARSE_PIXELS, FINE_PIXELS = 150, 1500  # of the object's outline
WIDE = (0.008, 0.003)  # [m], standard deviation of the noise that the first steps pretend
PLACING = 2  # steps that bring a surface over the points
TURNS = np.deg2rad(np.arange(30, 360, 30))  # [rad], about each axis: a mug's handle, a box's flips
ROUNDS, BETTER = 3, 0.02  # how often the best are turned, as long as the score grows by so much


@dataclass(frozen=True, eq=False)
class Candidate:
    """A pose and how well it explains the image.

    Attributes:
        T_co: The object in the camera frame.
        score: Share of what is seen of the object, or should be, in which image and pose agree; in [0, 1].
        contradiction: Share of what the pose says that the image denies; in [0, 1].
    """

    T_co: gtsam.Pose3
    score: float
    contradiction: float


def candidates(shape: Shape, view: View) -> list[Candidate]:
    """Poses of an object in an image, the best first; none where nothing is seen.

    Args:
        shape: The object.
        view: The image, in which all that has a depth and is not the hand is taken for the object.
    """
    points_c = view.camera.back_project(np.where(view.hand, 0.0, view.depth))
    if len(points_c) == 0:
        return []
    rough = _at(shape, np.eye(3), points_c.mean(axis=0))
    outline = outline_pixels(shape, view, rough)
    coarse = view.strided(stride(outline, COARSE_PIXELS))
    found = _search(shape, coarse, points_c.mean(axis=0))
    fine = view.strided(stride(outline, FINE_PIXELS))
    best = _aligned(shape, fine, [candidate.T_co for candidate in found], iterations=15)
    turned = _drawn_near(shape, fine, _turned(shape, best[0].T_co))  # what few pixels did not tell
    return _sorted([*best, *turned])[:KEPT]


def judge(shape: Shape, view: View, T_co: gtsam.Pose3) -> Candidate:
    """A pose with its score: the share of agreeing pixels among those that show the object or deny the pose.

    Pixels in which the object would be covered count neither way.
    """
    seen = Evidence(shape, view, T_co)
    visible = int(np.count_nonzero((view.depth > 0.0) & ~view.hand))
    return Candidate(T_co, seen.surface / max(visible + seen.through, 1), seen.contradiction)


def orientations(count: int) -> np.ndarray:
    """Rotation matrices spread evenly over all orientations, shape (count, 3, 3).

    Alexa, "Super-Fibonacci Spirals: Fast, Low-Discrepancy Sampling of SO(3)", CVPR 2022, algorithm 1.
    """
    from scipy.spatial.transform import Rotation

    phi, psi = np.sqrt(2.0), 1.533751168755204288118041
    s = np.arange(count) + 0.5
    inner, outer = np.sqrt(s / count), np.sqrt(1.0 - s / count)
    alpha, beta = 2.0 * np.pi * s / phi, 2.0 * np.pi * s / psi
    quat_xyzw = np.column_stack(
        [
            inner * np.sin(alpha),
            inner * np.cos(alpha),
            outer * np.sin(beta),
            outer * np.cos(beta),
        ]
    )
    matrices: np.ndarray = Rotation.from_quat(quat_xyzw).as_matrix()
    return matrices


def _search(shape: Shape, view: View, center_c: np.ndarray) -> list[Candidate]:
    """The best poses whose surface lies about there, the best first."""
    wide = replace(view, sigma=WIDE[0])
    placed = [_placed(shape, view, R, center_c) for R in orientations(ORIENTATIONS)]
    likely = _sorted(judge(shape, wide, T_co) for T_co in placed)[:TRIED]
    found = _drawn_near(shape, view, [candidate.T_co for candidate in likely])[:KEPT]
    for _ in range(ROUNDS):
        before = found[0].score
        turned = [T_co for best in found[:2] for T_co in _turned(shape, best.T_co)]
        found = _sorted([*found, *_drawn_near(shape, view, turned)])[:KEPT]
        if found[0].score < before + BETTER:
            break
    return found


def _drawn_near(shape: Shape, view: View, starts: list[gtsam.Pose3]) -> list[Candidate]:
    """These poses aligned with the image from farther away than its noise allows."""
    for sigma in WIDE:
        wide = replace(view, sigma=max(sigma, view.sigma))
        starts = [align(shape, wide, T_co, iterations=4) for T_co in starts]
    return _aligned(shape, view, starts, iterations=2)


def _aligned(
    shape: Shape, view: View, starts: Iterable[gtsam.Pose3], iterations: int
) -> list[Candidate]:
    """These poses aligned with the image, the best first."""
    aligned = [align(shape, view, T_co, iterations) for T_co in starts]
    return _sorted(judge(shape, view, T_co) for T_co in aligned)


def _sorted(found: Iterable[Candidate]) -> list[Candidate]:
    return sorted(found, key=lambda candidate: -candidate.score)


def _at(shape: Shape, R: np.ndarray, center_c: np.ndarray) -> gtsam.Pose3:
    """The pose of that orientation (3, 3) with the object's centre there [m], camera frame."""
    return gtsam.Pose3(gtsam.Rot3(R), center_c - R @ shape.center_o)


def _placed(shape: Shape, view: View, R: np.ndarray, center_c: np.ndarray) -> gtsam.Pose3:
    """The pose of that orientation whose visible surface has its middle there."""
    T_co = _at(shape, R, center_c)
    for _ in range(PLACING):
        predicted = Evidence(shape, view, T_co).predicted
        surface_c = view.camera.back_project(np.where(predicted < np.inf, predicted, 0.0))
        if len(surface_c) == 0:
            break
        T_co = gtsam.Pose3(T_co.rotation(), T_co.translation() + center_c - surface_c.mean(axis=0))
    return T_co


def _turned(shape: Shape, T_co: gtsam.Pose3) -> list[gtsam.Pose3]:
    """The object turned about each of its axes through its centre."""
    T_ob = gtsam.Pose3(gtsam.Rot3(), shape.center_o)
    turns = [np.outer(TURNS, axis) for axis in np.eye(3)]
    return [
        T_co * T_ob * gtsam.Pose3(gtsam.Rot3.Expmap(turn), np.zeros(3)) * T_ob.inverse()
        for turn in np.concatenate(turns)
    ]
