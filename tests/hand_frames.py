# SPDX-License-Identifier: MIT
"""Frames for the tests of the hand's factors: pads about an object, and poses at which derivatives exist."""

import gtsam
import numpy as np
from problems import ball_sdf, lump_sdf, pads_around, random_pose

from vtgtsam import Pad, PadSet
from vtgtsam.factors.pad_distances import PadDistances
from vtgtsam.sdf.search import ClosestPoints

RADIUS = 0.03  # [m], of the ball
VOXEL = 0.12 / 63  # [m], of its grid of 64 nodes a side


def values_at(T_ho, key=0):
    values = gtsam.Values()
    values.insert(key, T_ho)
    return values


def facing_pad(gap, touching=True):
    """One pad above the ball's top, ``gap`` away from it, facing down."""
    T_hp = np.diag([1.0, -1.0, -1.0, 1.0])
    T_hp[2, 3] = RADIUS + gap
    closest = ClosestPoints(PadSet([Pad("pad", (0.014, 0.018))]), ball_sdf(RADIUS, 64))
    return PadDistances(closest, T_hp[None], np.array([touching]))


def pads_about(seed, count=8, distance=RADIUS, touching=True, sdf=None):
    """Pads about a lump, or about the object of ``sdf``."""
    pads, T_hp = pads_around(seed, count, distance)
    closest = ClosestPoints(pads, lump_sdf(seed) if sdf is None else sdf)
    return PadDistances(closest, T_hp, np.broadcast_to(touching, count))


def smooth_frames(distance, count=12):
    """Frames (PadDistances, T_ho) of two touching pads whose closest points lie well inside a cell of the grid."""
    found = []
    for seed in range(80):
        pads = pads_about(seed, count=2, distance=distance)
        T_ho = gtsam.Pose3(random_pose(np.random.default_rng(seed), 0.3, 0.001))
        if _well_inside_a_cell(pads, T_ho, lump_sdf(seed)):
            found.append((pads, T_ho))
        if len(found) == count:
            return found
    raise AssertionError(f"only {len(found)} of {count} frames have derivatives")


def _well_inside_a_cell(pads, T_ho, sdf, margin=0.02):
    """Whether no closest point is within ``margin`` cells of a kink of the trilinear value."""
    points_h = pads.points_h(pads.at(T_ho))
    points_o = np.array([T_ho.transformTo(p) for p in points_h])
    place = (points_o - sdf.lower) * sdf.scale % 1.0
    return np.minimum(place, 1 - place).min() > margin
