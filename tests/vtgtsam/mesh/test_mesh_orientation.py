# SPDX-License-Identifier: MIT
import numpy as np
import pytest
import trimesh

from vtgtsam.exceptions import MeshError
from vtgtsam.mesh.orientation import outward
from vtgtsam.shapes import CATALOGUE


def test_closed_mesh_is_left_as_it_is():
    mesh = CATALOGUE["drill"].mesh()
    same, closed, problems = outward(mesh.vertices, mesh.faces)
    assert closed and problems == []
    assert same.volume == pytest.approx(mesh.volume)


def test_cavity_keeps_its_inward_faces():
    cavity = trimesh.creation.icosphere(subdivisions=2, radius=0.02)
    cavity.invert()
    hollow = trimesh.util.concatenate([trimesh.creation.icosphere(2, 0.03), cavity])
    same, closed, problems = outward(hollow.vertices, hollow.faces)
    assert closed and problems == []
    assert same.volume == pytest.approx(hollow.volume)


def test_two_sheets_that_cancel_out_have_no_volume():
    corners = [[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]]
    with pytest.raises(MeshError, match="no volume"):
        outward(np.array(corners), np.array([[0, 1, 2], [0, 2, 3], [0, 2, 1], [0, 3, 2]]))


def test_part_that_looks_inwards_is_turned_and_counted():
    mesh = CATALOGUE["plum"].mesh()
    inverted = mesh.copy().apply_translation([0.1, 0, 0])
    inverted.invert()
    small = mesh.copy().apply_scale(0.5).apply_translation([0, 0.1, 0])
    parts = trimesh.util.concatenate([mesh, inverted, small])
    turned, closed, problems = outward(parts.vertices, parts.faces)
    assert closed and len(problems) == 1 and problems[0].startswith("1 of the mesh's parts")
    assert turned.volume == pytest.approx(2.125 * mesh.volume)


def test_open_part_is_turned_to_what_most_of_its_faces_say():
    mesh = CATALOGUE["plum"].mesh()
    mesh.update_faces(mesh.triangles_center[:, 2] < 0.01)
    right = mesh.faces.copy()
    faces = right.copy()
    faces[::5] = faces[::5, ::-1]
    turned, closed, problems = outward(mesh.vertices, faces)
    assert not closed and len(problems) == 1 and "neighbouring faces" in problems[0]
    np.testing.assert_allclose(
        np.sort(turned.face_normals, axis=0), np.sort(mesh.face_normals, axis=0), atol=1e-9
    )


def side_panels(gap):
    """A box of six panels that nearly meet, one of them inverted."""
    panels = []
    for axis in range(3):
        for sign in (-1, 1):
            box = trimesh.creation.box(extents=(0.08, 0.06, 0.10))
            box.update_faces(sign * box.face_normals[:, axis] > 0.9)
            box.remove_unreferenced_vertices()
            panels.append(box.apply_translation(sign * gap * np.eye(3)[axis]))
    panels[3].invert()
    return trimesh.util.concatenate(panels)


@pytest.mark.parametrize("gap", [0.0, 1e-6, 1e-4])
def test_separate_panels_agree_whatever_lies_between_them(gap):
    mesh = side_panels(gap)
    turned, closed, problems = outward(mesh.vertices, mesh.faces)
    assert closed == (gap < 1e-5) and len(problems) == 1
    centres = turned.triangles_center
    assert ((turned.face_normals * centres).sum(axis=1) > 0).all()


@pytest.mark.parametrize("gap", [1e-6, 1e-4])
def test_triangles_that_are_not_stitched_look_out(gap):
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.04)
    centre = ball.triangles.mean(axis=1, keepdims=True)
    corners = centre + (ball.triangles - centre) * (1 - gap / 0.003)
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    flipped = np.random.default_rng(0).random(len(faces)) < 0.3
    faces[flipped] = faces[flipped, ::-1]
    turned, _, problems = outward(corners.reshape(-1, 3), faces)
    assert len(problems) == 1
    inwards = (turned.face_normals * turned.triangles_center).sum(axis=1) < 0
    assert inwards.mean() < 0.01  # of single triangles, a few rays pass through cracks


def test_a_wall_between_two_bodies_goes():
    a = trimesh.creation.box(extents=(0.06, 0.06, 0.10))
    b = trimesh.creation.box(extents=(0.06, 0.06, 0.04)).apply_translation((0, 0, 0.07))
    both = trimesh.util.concatenate([a, b])
    turned, closed, _ = outward(both.vertices, both.faces)
    assert closed
    np.testing.assert_allclose(turned.volume, 0.06 * 0.06 * 0.14, rtol=1e-9)
    assert not (np.abs(turned.triangles_center[:, 2] - 0.05) < 1e-9).any()
