# SPDX-License-Identifier: MIT
import numpy as np
import trimesh

from sim.hands import load_description
from sim.placement import CLEARANCE, MAX_YAW, above_palm, occ, vary

MESH = trimesh.creation.box(bounds=[(0.1, 0.0, 0.0), (0.13, 0.05, 0.09)])  # off its origin
PALM = load_description().palm.center


def in_world(T_wo):
    return MESH.vertices @ T_wo[:3, :3].T + T_wo[:3, 3]


def test_the_object_hangs_over_the_middle_of_the_palm():
    turned = trimesh.transformations.rotation_matrix(0.7, (1, 2, 3))[:3, :3]
    corners = in_world(above_palm(load_description(), MESH, turned, height=0.02))
    np.testing.assert_allclose((corners.max(0) + corners.min(0))[:2] / 2, PALM[:2])
    np.testing.assert_allclose(corners[:, 2].min() - PALM[2], 0.02 + CLEARANCE)


def test_vary_samples_heights_from_zero_to_half_the_shortest_edge():
    rng = np.random.default_rng(0)
    poses = [vary(load_description(), MESH, rng) for _ in range(300)]
    heights = np.array([in_world(T)[:, 2].min() for T in poses]) - PALM[2] - CLEARANCE
    assert heights.min() > -1e-9
    assert heights.max() < 0.015
    np.testing.assert_allclose(np.quantile(heights, (0.25, 0.75)), (0.00375, 0.01125), atol=0.0015)


def test_vary_samples_orientations_uniformly():
    rng = np.random.default_rng(0)
    rotations = np.array([vary(load_description(), MESH, rng)[:3, :3] for _ in range(600)])
    # Each axis points anywhere: its components have mean 0 and variance 1/3.
    np.testing.assert_allclose(rotations.mean(axis=0), 0.0, atol=0.1)
    np.testing.assert_allclose(rotations.var(axis=0), 1 / 3, atol=0.05)


def test_occ_turns_about_the_vertical_through_the_middle_by_at_most_5_degrees():
    rng = np.random.default_rng(0)
    rest = above_palm(load_description(), MESH, np.eye(3))
    yaws = []
    for _ in range(200):
        T_wo = occ(rest, MESH, rng)
        turn = T_wo[:3, :3] @ rest[:3, :3].T
        np.testing.assert_allclose(turn[2], (0, 0, 1), atol=1e-12)
        yaws.append(np.arctan2(turn[1, 0], turn[0, 0]))
        moved = in_world(T_wo).mean(axis=0) - in_world(rest).mean(axis=0)
        np.testing.assert_allclose(moved[:2], 0.0, atol=1e-12)
    assert np.abs(yaws).max() <= MAX_YAW
    assert np.abs(yaws).max() > 0.9 * MAX_YAW
