# SPDX-License-Identifier: MIT
import numpy as np
import pytest
import trimesh
from PIL import Image

from vtgtsam.exceptions import MeshError
from vtgtsam.mesh.reading import read_mesh, sha256_of
from vtgtsam.shapes import CATALOGUE


@pytest.mark.parametrize("suffix", ["obj", "ply", "stl", "glb", "off"])
def test_mesh_survives_the_common_formats(tmp_path, suffix):
    mesh = CATALOGUE["mug"].mesh()
    mesh.export(tmp_path / f"mug.{suffix}")
    again = read_mesh(tmp_path / f"mug.{suffix}")
    assert again.is_watertight
    assert len(again.faces) == len(mesh.faces)
    np.testing.assert_allclose(again.bounds, mesh.bounds, atol=1e-6)
    assert again.volume == pytest.approx(mesh.volume, rel=1e-4)


def test_textured_mesh_is_closed_at_its_seams(tmp_path):
    # A box whose six sides have texture coordinates of their own: 24 corners in the file.
    box = trimesh.creation.box(extents=[0.1, 0.06, 0.02])
    corners, faces = [], []
    for normal in np.unique(box.face_normals.round(6), axis=0):
        side = np.flatnonzero((box.face_normals @ normal) > 0.9)
        for face in side:
            faces.append(np.arange(3) + len(corners))
            corners.extend(box.vertices[box.faces[face]])
    lines = ["mtllib box.mtl", "usemtl skin"]
    lines += [f"v {x} {y} {z}" for x, y, z in corners]
    lines += [f"vt {n / len(corners)} {n % 2}" for n in range(len(corners))]
    lines += ["f " + " ".join(f"{n + 1}/{n + 1}" for n in face) for face in faces]
    (tmp_path / "box.obj").write_text("\n".join(lines))
    (tmp_path / "box.mtl").write_text("newmtl skin\nmap_Kd box.png\n")
    Image.new("RGB", (4, 4), "red").save(tmp_path / "box.png")
    mesh = read_mesh(tmp_path / "box.obj")
    assert len(mesh.vertices) == 8 and mesh.is_watertight


def test_parts_of_a_scene_lie_where_the_scene_puts_them(tmp_path):
    scene = trimesh.Scene()
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.01)
    scene.add_geometry(ball, transform=trimesh.transformations.translation_matrix([0.1, 0, 0]))
    scene.add_geometry(trimesh.creation.box(extents=[0.02] * 3))
    scene.export(tmp_path / "two.glb")
    mesh = read_mesh(tmp_path / "two.glb")
    assert mesh.body_count == 2
    np.testing.assert_allclose(mesh.bounds[1], [0.11, 0.01, 0.01], atol=1e-6)


def test_file_that_is_no_mesh_is_named_in_the_error(tmp_path):
    with pytest.raises(MeshError, match=r"no mesh file .*nothing\.obj"):
        read_mesh(tmp_path / "nothing.obj")
    (tmp_path / "text.stl").write_text("hello")
    with pytest.raises(MeshError, match=r"text\.stl"):
        read_mesh(tmp_path / "text.stl")
    (tmp_path / "empty.obj").write_text("v 0 0 0\n")
    with pytest.raises(MeshError, match=r"empty\.obj"):
        read_mesh(tmp_path / "empty.obj")
    (tmp_path / "mesh.unknown").write_text("?")
    with pytest.raises(MeshError, match=r"convert it to OBJ, PLY or STL"):
        read_mesh(tmp_path / "mesh.unknown")


def test_coordinates_that_are_not_finite_are_refused(tmp_path):
    (tmp_path / "nan.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 nan 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n")
    with pytest.raises(MeshError, match="not finite"):
        read_mesh(tmp_path / "nan.obj")


def test_hash_depends_on_the_geometry_alone(tmp_path):
    mesh = CATALOGUE["apple"].mesh()
    again = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False, face_colors=[1, 2, 3, 255])
    assert sha256_of(again.vertices, again.faces) == sha256_of(mesh.vertices, mesh.faces)
    moved = mesh.copy().apply_translation([1e-6, 0, 0])
    assert sha256_of(moved.vertices, moved.faces) != sha256_of(mesh.vertices, mesh.faces)
