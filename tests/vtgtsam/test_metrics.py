# SPDX-License-Identifier: MIT
import gtsam
import igl
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from ycb import ycb_path

from vtgtsam import adds
from vtgtsam.metrics import (
    Adds,
    add,
    add_each,
    relative_poses,
    rotation_error,
    rotation_errors,
    translation_error,
    translation_errors,
)
from vtgtsam.shapes import CATALOGUE

TENS = st.floats(-10, 10)


def random_pose(rng, angle=3.0, distance=1.0):
    return gtsam.Pose3.Expmap(
        np.concatenate([rng.uniform(-angle, angle, 3), rng.uniform(-distance, distance, 3)])
    )


def libigl_adds(mesh, T_est, T_true):
    """The definition, by 4x4 matrices and libigl."""
    placed = trimesh.transform_points(
        mesh.vertices, np.linalg.inv(T_true.matrix()) @ T_est.matrix()
    )
    squared, _, _ = igl.point_mesh_squared_distance(
        placed, np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64)
    )
    return np.sqrt(squared).mean()


@pytest.mark.parametrize("name", ["mug", "banana", "ball"])
@pytest.mark.parametrize("size", [1e-4, 0.01, 0.1])
def test_adds_is_the_mean_over_vertices_of_the_distance_to_the_triangles(name, size):
    mesh, rng = CATALOGUE[name].mesh(), np.random.default_rng(0)
    for _ in range(3):
        T_true = random_pose(rng)
        T_est = T_true * random_pose(rng, angle=10 * size, distance=size)
        expected = libigl_adds(mesh, T_est, T_true)
        assert adds(mesh, T_est, T_true) == pytest.approx(expected, abs=1e-12)


def test_adds_of_a_ycb_mesh_is_libigls():
    mesh, rng = trimesh.load_mesh(ycb_path("035_power_drill")), np.random.default_rng(1)
    for size in (0.001, 0.01, 0.1):
        T_est, T_true = random_pose(rng, size, size), random_pose(rng, size, size)
        expected = libigl_adds(mesh, T_est, T_true)
        assert adds(mesh, T_est, T_true) == pytest.approx(expected, abs=1e-12)


def test_adds_of_a_box_that_slides_along_itself():
    # Two of the box's faces slide in their own plane; the vertices of one end come out by d.
    box = trimesh.creation.box(extents=[0.1, 0.06, 0.02])
    d = 0.004
    slid = gtsam.Pose3(gtsam.Rot3(), [d, 0, 0])
    # 4 vertices lie d outside the far end, 4 on the sides, where the surface is at hand.
    assert adds(box, slid, gtsam.Pose3()) == pytest.approx(d / 2, abs=1e-15)
    assert add(box, slid, gtsam.Pose3()) == pytest.approx(d, abs=1e-15)


def test_adds_measures_to_triangles_and_not_to_vertices():
    # Slid by half an edge each vertex lies in the middle of an edge: on the surface, off the vertices.
    ball = trimesh.creation.box(extents=[0.1] * 3).subdivide()
    half_turn = gtsam.Pose3(gtsam.Rot3.Rz(np.pi / 4), np.zeros(3))
    quarter_turn = gtsam.Pose3(gtsam.Rot3.Rz(np.pi / 2), np.zeros(3))
    assert adds(ball, quarter_turn, gtsam.Pose3()) == pytest.approx(0, abs=1e-12)
    assert add(ball, quarter_turn, gtsam.Pose3()) > 0.03
    assert adds(ball, half_turn, gtsam.Pose3()) > 0.001


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_metrics_do_not_depend_on_the_world_frame(seed):
    rng = np.random.default_rng(seed)
    mesh = CATALOGUE["padlock"].mesh()
    T_est, T_true, W = random_pose(rng, 0.3, 0.01), random_pose(rng, 0.3, 0.01), random_pose(rng)
    center = np.array([0.01, 0.02, -0.01])
    assert adds(mesh, W * T_est, W * T_true) == pytest.approx(adds(mesh, T_est, T_true), abs=1e-12)
    assert add(mesh, W * T_est, W * T_true) == pytest.approx(add(mesh, T_est, T_true), abs=1e-12)
    assert translation_error(W * T_est, W * T_true, center) == pytest.approx(
        translation_error(T_est, T_true, center), abs=1e-12
    )
    assert rotation_error(W * T_est, W * T_true) == pytest.approx(
        rotation_error(T_est, T_true), abs=1e-7
    )


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_adds_is_at_most_add_and_zero_at_the_truth(seed):
    rng = np.random.default_rng(seed)
    mesh = CATALOGUE["plum"].mesh()
    T_est, T_true = random_pose(rng, 1, 0.05), random_pose(rng, 1, 0.05)
    assert adds(mesh, T_est, T_true) <= add(mesh, T_est, T_true) + 1e-12
    assert adds(mesh, T_true, T_true) == pytest.approx(0, abs=1e-12)


def test_turning_a_ball_leaves_adds_at_the_size_of_its_facets():
    mesh = CATALOGUE["ball"].mesh()
    turned = gtsam.Pose3(gtsam.Rot3.Rz(1.0), np.zeros(3))
    assert adds(mesh, turned, gtsam.Pose3()) < 5e-5
    assert add(mesh, turned, gtsam.Pose3()) > 0.01


def test_adds_notices_that_a_mesh_has_changed():
    mesh = CATALOGUE["mug"].mesh()
    moved = gtsam.Pose3(gtsam.Rot3(), [0.001, 0, 0])
    first = adds(mesh, moved, gtsam.Pose3())
    mesh.apply_scale(2)
    assert adds(mesh, moved, gtsam.Pose3()) == pytest.approx(
        libigl_adds(mesh, moved, gtsam.Pose3()), abs=1e-12
    )
    assert adds(mesh, moved, gtsam.Pose3()) != pytest.approx(first, abs=1e-7)


def test_adds_of_many_meshes_in_turn_stays_right():
    rng = np.random.default_rng(2)
    meshes = [trimesh.creation.icosphere(1, radius) for radius in np.linspace(0.01, 0.05, 20)]
    T = random_pose(rng, 0.1, 0.01)
    for mesh in [*meshes, *meshes]:
        expected = libigl_adds(mesh, T, gtsam.Pose3())
        assert adds(mesh, T, gtsam.Pose3()) == pytest.approx(expected, abs=1e-12)


def test_pose_that_is_not_finite_gives_nan():
    lost = gtsam.Pose3(gtsam.Rot3(), [np.nan, 0, 0])
    assert np.isnan(adds(CATALOGUE["ball"].mesh(), lost, gtsam.Pose3()))


def test_translation_error_is_that_of_the_objects_centre():
    center = np.array([0.1, 0, 0])
    turned = gtsam.Pose3(gtsam.Rot3.Rz(np.pi / 2), np.zeros(3))
    assert translation_error(turned, gtsam.Pose3(), center) == pytest.approx(0.1 * np.sqrt(2))
    assert translation_error(turned, gtsam.Pose3(), np.zeros(3)) == 0


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 1.0, np.pi - 1e-6, np.pi])
def test_rotation_error_is_the_angle_between(angle):
    rng = np.random.default_rng(3)
    axis = rng.normal(size=3)
    T_true = random_pose(rng)
    T_est = T_true * gtsam.Pose3(gtsam.Rot3.AxisAngle(axis, angle), rng.normal(size=3))
    assert rotation_error(T_est, T_true) == pytest.approx(angle, abs=1e-12 + 1e-9 * angle)


def smallest_angle(between, symmetry, steps=720):
    """As BOP does it: all discrete turns, each with all turns about the axis in small steps."""
    turns = [np.eye(3)]
    turns += [np.reshape(t, (4, 4))[:3, :3] for t in symmetry.get("symmetries_discrete", [])]
    spins = [np.eye(3)]
    for axis in symmetry.get("symmetries_continuous", []):
        spins = [
            trimesh.transformations.rotation_matrix(a, axis["axis"])[:3, :3]
            for a in np.linspace(0, 2 * np.pi, steps, endpoint=False)
        ]
    cosines = [(np.trace(between @ t @ s) - 1) / 2 for t in turns for s in spins]
    return np.arccos(np.clip(np.max(cosines), -1, 1))


@pytest.mark.parametrize("name", ["can", "pear", "padlock", "box", "cube", "screwdriver", "mug"])
def test_rotation_error_is_the_smallest_over_the_objects_symmetries(name):
    symmetry = CATALOGUE[name].symmetry
    rng = np.random.default_rng(4)
    for _ in range(12):
        T_est, T_true = random_pose(rng), random_pose(rng)
        between = T_est.rotation().between(T_true.rotation()).matrix()
        found = rotation_error(T_est, T_true, symmetry)
        assert found == pytest.approx(smallest_angle(between, symmetry or {}), abs=5e-3)
        assert found <= rotation_error(T_est, T_true) + 1e-12


def test_rotation_error_of_a_ball_is_zero():
    rng = np.random.default_rng(5)
    symmetry = CATALOGUE["ball"].symmetry
    assert rotation_error(random_pose(rng), random_pose(rng), symmetry) == 0.0


@pytest.mark.parametrize("name", ["mug", "can", "box", "ball"])
def test_errors_of_many_pairs_are_those_of_each_pair(name):
    rng, mesh, symmetry = np.random.default_rng(6), CATALOGUE[name].mesh(), CATALOGUE[name].symmetry
    center = np.array([0.01, 0.02, -0.01])
    sizes = [0.0, 1e-6, 1e-4, 1e-3, 0.01, 0.1, 10.0] * 3
    T_true = [random_pose(rng) for _ in sizes]
    T_est = [T * random_pose(rng, 10 * s, s) for T, s in zip(T_true, sizes, strict=True)]
    relative = relative_poses(T_est, T_true)
    pairs = list(zip(T_est, T_true, strict=True))
    for found, each in (
        (Adds(mesh).each(relative), lambda pair: libigl_adds(mesh, *pair)),
        (add_each(mesh, relative), lambda pair: plain_add(mesh, *pair)),
        (translation_errors(relative, center), lambda pair: translation_error(*pair, center)),
        (rotation_errors(relative, symmetry), lambda pair: rotation_error(*pair, symmetry)),
    ):
        np.testing.assert_allclose(found, [each(pair) for pair in pairs], rtol=1e-12, atol=1e-12)


def plain_add(mesh, T_est, T_true):
    """The definition, in the world frame."""
    placed = [trimesh.transform_points(mesh.vertices, T.matrix()) for T in (T_est, T_true)]
    return np.linalg.norm(placed[0] - placed[1], axis=1).mean()


def test_errors_of_a_pose_that_is_not_finite_are_nan_and_leave_the_others_alone():
    mesh = CATALOGUE["mug"].mesh()
    moved = gtsam.Pose3(gtsam.Rot3.Rz(0.1), [0.001, 0, 0])
    lost = gtsam.Pose3(gtsam.Rot3(), [np.nan, 0, 0])
    relative = relative_poses([moved, lost, moved], [gtsam.Pose3()] * 3)
    for found in (
        Adds(mesh).each(relative),
        add_each(mesh, relative),
        translation_errors(relative, np.zeros(3)),
    ):
        np.testing.assert_array_equal(np.isfinite(found), [True, False, True])
        assert found[0] == pytest.approx(found[2], rel=1e-12)


def test_errors_of_no_pairs_are_none():
    mesh, relative = CATALOGUE["ball"].mesh(), relative_poses([], [])
    for found in (Adds(mesh).each(relative), add_each(mesh, relative), rotation_errors(relative)):
        assert found.shape == (0,)


def test_adds_of_what_is_no_mesh_or_pose_is_refused_with_what_makes_one():
    mesh = trimesh.creation.box()
    for arguments in (("mug", gtsam.Pose3(), gtsam.Pose3()), (mesh, np.eye(4), gtsam.Pose3())):
        with pytest.raises(ValueError, match="must be a .*, got (str|ndarray): "):
            adds(*arguments)
