# SPDX-License-Identifier: MIT
import numpy as np
import pytest
import trimesh

from vtgtsam.shapes import CATALOGUE, NAMES
from vtgtsam.shapes.symmetry import CUBE, SQUARE, moved
from vtgtsam.surface import Surface

SHAPES = list(CATALOGUE.values())


def transforms(symmetry):
    """Discrete symmetries (n, 4, 4), and eight turns about each continuous axis [m]."""
    found = [np.reshape(turn, (4, 4)).copy() for turn in symmetry.get("symmetries_discrete", [])]
    for turn in found:
        turn[:3, 3] *= 1e-3  # BOP's are in millimetres
    for axis in symmetry.get("symmetries_continuous", []):
        center = np.array(axis["offset"]) * 1e-3
        for angle in np.arange(1, 8) * 0.77:
            found.append(trimesh.transformations.rotation_matrix(angle, axis["axis"], center))
    return found


def largest_change(mesh, transform):
    """Largest distance of a moved vertex to the surface that was [m]."""
    moved_vertices = trimesh.transform_points(mesh.vertices, transform)
    return Surface(mesh.vertices, mesh.faces).distances(moved_vertices).max()


def test_there_are_enough_objects_with_names_of_their_own():
    assert len(NAMES) >= 17 and len(set(NAMES)) == len(NAMES)
    assert len({shape.ycb for shape in SHAPES}) == len(SHAPES)
    for name in ("can", "box", "bottle", "mug", "banana", "ball"):
        assert name in CATALOGUE


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.name)
def test_shape_is_one_closed_body_of_the_published_size(shape):
    mesh = shape.mesh()
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.body_count == 1
    assert mesh.volume > 0
    assert 2000 <= len(mesh.faces) <= 13_000
    np.testing.assert_allclose(mesh.extents * 1e3, shape.size_mm, atol=0.2)
    np.testing.assert_allclose(mesh.bounds.sum(axis=0), 0, atol=1e-7)
    assert 0.005 < shape.mass < 1.0
    # From foam and hollow plastic fruit to brass.
    assert 40 < shape.mass / mesh.volume < 8500  # [kg/m^3]


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.name)
def test_shape_is_the_same_every_time_and_in_every_file_format(shape, tmp_path):
    mesh, again = shape.mesh(), shape.mesh()
    np.testing.assert_array_equal(mesh.vertices, again.vertices)
    np.testing.assert_array_equal(mesh.faces, again.faces)
    mesh.export(tmp_path / "mesh.ply")  # single precision
    stored = trimesh.load_mesh(tmp_path / "mesh.ply", process=False)
    np.testing.assert_array_equal(stored.vertices, mesh.vertices)


@pytest.mark.parametrize("shape", [s for s in SHAPES if s.symmetry], ids=lambda shape: shape.name)
def test_shape_has_the_symmetry_it_claims(shape):
    mesh = shape.mesh()
    for transform in transforms(shape.symmetry):
        # Facets around an axis leave up to a few tenths of a millimetre.
        assert largest_change(mesh, transform) < 4e-4


@pytest.mark.parametrize("name", ["banana", "mug", "drill", "peach", "plum"])
def test_shape_without_symmetry_looks_different_after_a_half_turn(name):
    mesh = CATALOGUE[name].mesh()
    assert CATALOGUE[name].symmetry is None
    for axis in np.eye(3):
        turn = trimesh.transformations.rotation_matrix(np.pi, axis)
        assert largest_change(mesh, turn) > 1e-3


@pytest.mark.parametrize("name", ["can", "pear", "cup", "bottle", "padlock", "box"])
def test_shape_claims_no_more_symmetry_than_it_has(name):
    mesh, symmetry = CATALOGUE[name].mesh(), CATALOGUE[name].symmetry
    free = {tuple(np.abs(a["axis"])) for a in symmetry.get("symmetries_continuous", [])}
    for axis in np.eye(3):
        quarter = trimesh.transformations.rotation_matrix(np.pi / 2, axis)
        assert (largest_change(mesh, quarter) > 1e-3) == (tuple(axis) not in free)


def test_square_block_and_cube_have_all_their_turns():
    assert len(SQUARE["symmetries_discrete"]) == 7  # of the 8 rotations of a square prism
    assert len(CUBE["symmetries_discrete"]) == 23  # of the 24 of a cube


def test_symmetry_moves_with_the_origin():
    center = np.array([0.02, -0.01, 0.05])
    for name in ("padlock", "can", "cube"):
        mesh = CATALOGUE[name].mesh().apply_translation(center)
        for transform in transforms(moved(CATALOGUE[name].symmetry, center)):
            assert largest_change(mesh, transform) < 4e-4
