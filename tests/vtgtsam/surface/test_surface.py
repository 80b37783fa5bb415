# SPDX-License-Identifier: MIT
import igl
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from ycb import ycb_path

from vtgtsam.shapes import CATALOGUE
from vtgtsam.surface import Surface, moved


def libigl_distances(points, vertices, faces):
    points = np.ascontiguousarray(points, dtype=float)
    squared, _, _ = igl.point_mesh_squared_distance(
        points, np.ascontiguousarray(vertices, dtype=float), np.ascontiguousarray(faces, np.int64)
    )
    return np.sqrt(squared)


def around(vertices, count, seed, reach=1.0):
    low, high = np.min(vertices, axis=0), np.max(vertices, axis=0)
    size = (high - low).max()
    return np.random.default_rng(seed).uniform(low - reach * size, high + reach * size, (count, 3))


@pytest.mark.parametrize("name", ["mug", "banana", "drill", "tuna_can"])
def test_distances_are_libigls(name):
    mesh = CATALOGUE[name].mesh()
    surface = Surface(mesh.vertices, mesh.faces)
    for points in (around(mesh.vertices, 5000, 0), mesh.vertices, mesh.triangles_center):
        expected = libigl_distances(points, mesh.vertices, mesh.faces)
        np.testing.assert_allclose(surface.distances(points), expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", ["024_bowl", "037_scissors", "072-a_toy_airplane"])
def test_distances_to_ycb_meshes_are_libigls(name):
    mesh = trimesh.load_mesh(ycb_path(name))
    points = around(mesh.vertices, 20_000, 1, reach=0.3)
    found = Surface(mesh.vertices, mesh.faces).distances(points)
    expected = libigl_distances(points, mesh.vertices, mesh.faces)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 700), size=st.floats(0.01, 1.0))
def test_any_triangles_however_many_give_libigls_distances(seed, count, size):
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(count, 1, 3)) + size * rng.normal(size=(count, 3, 3))
    vertices, faces = corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)
    points = rng.normal(scale=2, size=(50, 3))
    np.testing.assert_allclose(
        Surface(vertices, faces).distances(points),
        libigl_distances(points, vertices, faces),
        atol=1e-12,
    )


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 2000), nodes=st.integers(2, 14))
def test_a_block_of_grid_nodes_leaves_out_no_triangle_that_matters(seed, count, nodes):
    rng = np.random.default_rng(seed)
    # Triangles on a bumpy ball around the grid's centre, where many are nearly as near as the nearest.
    middle = rng.normal(size=(count, 1, 3))
    middle *= (1 + 0.01 * rng.normal(size=(count, 1, 1))) / np.linalg.norm(middle, axis=2)[
        ..., None
    ]
    corners = middle + 0.1 * rng.normal(size=(count, 3, 3))
    vertices, faces = corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)
    ticks = np.linspace(-1.5, 1.5, nodes) * rng.uniform(0.05, 1)
    points = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1)
    surface = Surface(vertices, faces)
    np.testing.assert_allclose(
        surface.grid_distances(ticks).ravel(),
        libigl_distances(points.reshape(-1, 3), vertices, faces),
        atol=1e-12,
    )


def test_grid_at_the_centre_of_a_ball_is_exact_although_all_triangles_are_candidates():
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.02)
    ticks = np.linspace(-1e-4, 1e-4, 6)
    points = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1)
    found = Surface(ball.vertices, ball.faces).grid_distances(ticks)
    expected = libigl_distances(points.reshape(-1, 3), ball.vertices, ball.faces)
    np.testing.assert_allclose(found.ravel(), expected, atol=1e-14)


@pytest.mark.parametrize(
    "corners",
    [
        [[0, 0, 0], [0, 0, 0], [1, 0, 0]],  # two corners at one place
        [[0, 0, 0], [0.5, 0, 0], [1, 0, 0]],  # all in a line
        [[0, 0, 0], [1, 0, 0], [0.5, 1e-14, 0]],  # nearly
    ],
)
def test_triangle_without_area_counts_as_the_segment_it_is(corners):
    surface = Surface(np.array(corners, float), [[0, 1, 2]])
    found = surface.distances([[0.3, 0.4, 0.0], [-3.0, 0.0, 4.0], [2.0, 0.0, 0.0]])
    np.testing.assert_allclose(found, [0.4, 5.0, 1.0], atol=1e-12)


def test_triangle_without_extent_counts_as_a_point():
    found = Surface(np.zeros((3, 3)), [[0, 1, 2]]).distances([[3.0, 4.0, 0.0]])
    np.testing.assert_allclose(found, [5.0])


def test_any_start_gives_the_same_distances_and_learns_the_nearest():
    mesh = CATALOGUE["padlock"].mesh()
    surface = Surface(mesh.vertices, mesh.faces)
    points = around(mesh.vertices, 500, 2)
    slots = surface.tree.triangles.shape[0] * 8
    expected = surface.distances(points)
    start = np.random.default_rng(3).integers(0, slots, len(points))
    np.testing.assert_array_equal(surface.distances(points, start), expected)
    learned = start.copy()
    np.testing.assert_array_equal(surface.distances(points, start), expected)
    np.testing.assert_array_equal(start, learned)


def test_point_that_is_not_finite_gives_nan():
    surface = Surface(np.eye(3), [[0, 1, 2]])
    found = surface.distances([[0, 0, 0], [np.nan, 0, 0], [1, 1, 1]])
    np.testing.assert_array_equal(np.isnan(found), [False, True, False])


def test_a_surface_needs_triangles():
    with pytest.raises(ValueError, match="triangles"):
        Surface(np.zeros((0, 3)), np.zeros((0, 3), int))
    with pytest.raises(ValueError, match="finite"):
        Surface(np.full((3, 3), np.nan), [[0, 1, 2]])
    with pytest.raises(ValueError, match=r"\(N, 3\)"):
        Surface(np.eye(3), [[0, 1, 2]]).distances([0.0, 1.0, 2.0])


def random_transforms(rng, count, angle, distance):
    """Rows (R | t) of poses near one that is anywhere, shape (count, 3, 4)."""
    turns = Rotation.from_rotvec(rng.normal(scale=angle, size=(count, 3)))
    moves = rng.normal(scale=distance, size=(count, 3))
    anywhere = Rotation.random(random_state=rng.integers(2**31))
    return np.concatenate([(turns * anywhere).as_matrix(), moves[:, :, None]], axis=2)


def one_by_one(surface, points, transforms):
    """The definition: all distances in one pose after the other."""
    moved = [points @ rows[:, :3].T + rows[:, 3] for rows in transforms]
    return np.array([surface.distances(some).mean() for some in moved])


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 200),
    points=st.integers(1, 300),
    angle=st.sampled_from([0.0, 1e-3, 0.1, 3.0]),
    distance=st.sampled_from([0.0, 1e-3, 0.1, 100.0]),
)
def test_mean_distances_of_many_poses_are_those_of_each(seed, count, points, angle, distance):
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(100, 1, 3)) + 0.3 * rng.normal(size=(100, 3, 3))
    surface = Surface(corners.reshape(-1, 3), np.arange(300).reshape(-1, 3))
    transforms = random_transforms(rng, count, angle, distance)
    some = rng.normal(size=(points, 3))
    np.testing.assert_allclose(
        surface.mean_distances(some, transforms),
        one_by_one(surface, some, transforms),
        rtol=1e-13,
        atol=1e-13,
    )


@pytest.mark.parametrize("name", ["mug", "banana", "tuna_can"])
@pytest.mark.parametrize("distance", [1e-4, 1e-3, 0.01, 0.1, 1.0])
def test_mean_distances_of_an_object_that_is_tracked_are_exact(name, distance):
    mesh, rng = CATALOGUE[name].mesh(), np.random.default_rng(4)
    transforms = random_transforms(rng, 40, 10 * distance, distance)
    transforms[20] = np.eye(4)[:3]
    transforms[30, :, 3] += 1e3  # lost: all that lie together are sorted into one cell
    surface = Surface(mesh.vertices, mesh.faces)
    vertices = np.array(mesh.vertices)
    np.testing.assert_allclose(
        surface.mean_distances(vertices, transforms),
        one_by_one(surface, vertices, transforms),
        rtol=1e-14,
        atol=1e-15,
    )


def test_mean_distances_do_not_depend_on_how_many_poses_are_sorted_together(monkeypatch):
    mesh, rng = CATALOGUE["padlock"].mesh(), np.random.default_rng(5)
    transforms = random_transforms(rng, 50, 0.1, 0.01)
    surface, vertices = Surface(mesh.vertices, mesh.faces), np.array(mesh.vertices)
    expected = surface.mean_distances(vertices, transforms)
    for together in (1, 7 * len(vertices)):
        monkeypatch.setattr(moved, "TOGETHER", together)
        found = surface.mean_distances(vertices, transforms)
        np.testing.assert_allclose(found, expected, rtol=1e-14)


def test_mean_distance_is_nan_where_a_transform_is_not_finite():
    surface = Surface(np.eye(3), [[0, 1, 2]])
    transforms = np.repeat(np.eye(4)[None, :3], 4, axis=0)
    transforms[1, 0, 3], transforms[2, 1, 1] = np.nan, np.inf
    found = surface.mean_distances(np.eye(3), transforms)
    np.testing.assert_array_equal(np.isnan(found), [False, True, True, False])
    np.testing.assert_allclose(found[[0, 3]], 0, atol=1e-15)
    assert np.isnan(surface.mean_distances(np.eye(3), transforms[1:2])).all()
    assert surface.mean_distances(np.eye(3), transforms[:0]).shape == (0,)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), thin=st.sampled_from([1e-16, 1e-13, 1e-9, 1e-5]))
def test_thin_triangles_are_as_far_as_libigl_says_or_as_their_longest_edge(seed, thin):
    # Where a triangle is thinner than rounding, it is its longest edge, to within that thickness.
    rng = np.random.default_rng(seed)
    a, b, across = rng.normal(size=(3, 3))
    corner = a + rng.uniform() * (b - a) + thin * across
    points = rng.normal(size=(20, 3))
    found = Surface([a, corner, b], [[0, 1, 2]]).distances(points)
    t = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    edge = np.linalg.norm(points - a - t[:, None] * (b - a), axis=1)
    np.testing.assert_allclose(found, edge, atol=1e-13 + 5 * thin)
