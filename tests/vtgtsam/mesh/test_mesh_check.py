# SPDX-License-Identifier: MIT
import numpy as np
import pytest
import trimesh

from vtgtsam import GridSdf, VtgtsamError
from vtgtsam.mesh import check
from vtgtsam.mesh.check import check_mesh
from vtgtsam.shapes import CATALOGUE


@pytest.fixture(autouse=True)
def empty_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("VTGTSAM_CACHE", str(tmp_path / "cache"))


def saved(mesh, tmp_path):
    mesh.export(tmp_path / "mesh.ply")
    return tmp_path / "mesh.ply"


def test_good_mesh_has_no_problems_and_its_size_is_printed_in_mm(tmp_path):
    report = check_mesh(saved(CATALOGUE["ball"].mesh(), tmp_path), resolution=48)
    assert report.problems == []
    text = str(report)
    assert "extents: 64.7 x 64.7 x 64.7 mm at scale 1" in text
    assert "watertight, volume 141.5 cm3" in text
    assert "5120 faces, 2562 vertices, 1 body" in text
    assert "0 wrong signs" in text and text.endswith("no problems found")


def test_mesh_in_millimetres_is_a_problem_that_its_scale_solves(tmp_path):
    path = saved(CATALOGUE["ball"].mesh().apply_scale(1000), tmp_path)
    report = check_mesh(path)
    (problem,) = report.problems
    assert "millimetres or centimetres" in problem and "--scale 0.001 or 0.01" in problem
    assert "watertight, volume 141,5" in str(report) and "e+" not in str(report)
    assert check_mesh(path, scale=0.001, resolution=32).problems == []


def test_hole_is_counted_and_named(tmp_path):
    mesh = CATALOGUE["ball"].mesh()
    mesh.update_faces(np.arange(len(mesh.faces)) != 7)
    report = check_mesh(saved(mesh, tmp_path), resolution=32)
    assert any("not watertight: 3 edges" in line for line in report.lines)
    assert len(report.problems) == 1 and "not watertight" in report.problems[0]


def test_faces_that_look_inwards_are_a_problem(tmp_path):
    mesh = CATALOGUE["ball"].mesh()
    mesh.invert()
    (problem,) = check_mesh(saved(mesh, tmp_path), resolution=32).problems
    assert "look inwards" in problem


def test_thin_wall_is_a_problem_until_the_resolution_keeps_it(tmp_path):
    sheet = trimesh.creation.box(extents=[0.1, 0.1, 0.004])
    path = saved(sheet, tmp_path)
    (problem,) = check_mesh(path, resolution=32).problems  # a node every 3.9 mm
    assert "thinner than two voxels" in problem and "resolution of 62" in problem
    assert check_mesh(path, resolution=62).problems == []


def test_wrong_sign_is_found(tmp_path, monkeypatch):
    def turned_field(mesh, resolution):
        sdf = original(mesh, resolution)
        return GridSdf(-sdf.values, sdf.lower, sdf.upper)

    original = check.build_sdf
    monkeypatch.setattr(check, "build_sdf", turned_field)
    report = check_mesh(saved(CATALOGUE["ball"].mesh(), tmp_path), resolution=32)
    assert any("wrong sign" in problem for problem in report.problems)


def test_flat_mesh_is_a_problem(tmp_path):
    flat = trimesh.Trimesh([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], [[0, 1, 2]])
    (problem,) = check_mesh(saved(flat, tmp_path)).problems
    assert "no volume" in problem


def test_file_that_is_no_mesh_raises(tmp_path):
    with pytest.raises(VtgtsamError, match="no mesh file"):
        check_mesh(tmp_path / "missing.obj")
