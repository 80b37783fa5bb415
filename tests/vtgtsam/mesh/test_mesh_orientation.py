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
    assert not closed and len(problems) == 2
    np.testing.assert_allclose(
        np.sort(turned.face_normals, axis=0), np.sort(mesh.face_normals, axis=0), atol=1e-9
    )
