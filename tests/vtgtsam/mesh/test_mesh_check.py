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
    assert "signs: 0 wrong of" in text and text.endswith("no problems found")


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


@pytest.mark.parametrize("halvings", [4, 6])
def test_thin_walls_are_seen_however_fine_the_mesh_is(tmp_path, halvings):
    sheet = trimesh.creation.box(extents=(0.06, 0.04, 0.0005))
    for _ in range(halvings):  # 3,072 and 49,152 faces
        sheet = sheet.subdivide()
    report = check_mesh(saved(sheet, tmp_path), resolution=64)
    (problem,) = report.problems
    assert "98 % of the surface belongs to walls thinner than two voxels" in problem
    assert any("more than 0.50 mm of material" in line for line in report.lines)


def bottle(overlap):
    """A body with a cap on it whose faces are inverted: as wide as the body, or narrower."""
    body = trimesh.creation.box(extents=(0.06, 0.06, 0.10))
    cap = trimesh.creation.box(extents=(overlap, overlap, 0.03)).apply_translation((0, 0, 0.065))
    cap.invert()
    return trimesh.util.concatenate([body, cap])


@pytest.mark.parametrize("width", [0.06, 0.03])
def test_an_inverted_cap_is_turned_and_found_where_it_is_not(tmp_path, monkeypatch, width):
    path = saved(bottle(width), tmp_path)
    report = check_mesh(path, resolution=64)
    assert any("look inwards; they were turned" in problem for problem in report.problems)
    assert not any("wrong by" in p or "wrong sign" in p for p in report.problems)

    def cap_outside(mesh, resolution):
        sdf = original(mesh, resolution)
        axes = [np.linspace(a, b, 64) for a, b in zip(sdf.lower, sdf.upper, strict=True)]
        x, y, z = np.meshgrid(*axes, indexing="ij")
        in_cap = (np.maximum(abs(x), abs(y)) < width / 2) & (z > 0.05) & (z < 0.08)
        return GridSdf(np.where(in_cap, abs(sdf.values), sdf.values), sdf.lower, sdf.upper)

    original = check.build_sdf
    monkeypatch.setattr(check, "build_sdf", cap_outside)
    report = check_mesh(path, resolution=64)
    assert any("has the outside on both of its sides" in problem for problem in report.problems)


def test_an_audit_takes_its_truth_from_the_mesh_as_it_came(tmp_path, monkeypatch):
    def without_a_side(mesh, resolution):
        kept = mesh.submesh([np.flatnonzero(mesh.triangles_center[:, 0] < 0.02)], append=True)
        return original(kept, resolution)

    original = check.build_sdf
    monkeypatch.setattr(check, "build_sdf", without_a_side)
    report = check_mesh(saved(CATALOGUE["ball"].mesh(), tmp_path), resolution=48)
    assert any("distance field is wrong by up to" in problem for problem in report.problems)


def test_an_open_mesh_is_closed_by_a_lid_and_says_so(tmp_path):
    box = trimesh.creation.box(extents=(0.08, 0.06, 0.12))
    box.update_faces(box.triangles_center[:, 2] > -0.0599)
    report = check_mesh(saved(box, tmp_path), resolution=48)
    opened, rays = report.problems
    assert "open about 5" in opened and "closed there by a lid" in opened
    assert "only 88 % of rays" in rays
    assert any("points at lids and inner walls left out" in line for line in report.lines)


def test_parts_that_overlap_are_a_problem(tmp_path):
    """Between their surfaces a point is deep in the object, but near a face. A quarter of each ball, less its rim."""
    halves = [trimesh.creation.icosphere(3, 0.03).apply_translation((x, 0, 0)) for x in (0, 0.03)]
    trimesh.util.concatenate(halves).export(tmp_path / "two.ply")
    problems = check_mesh(tmp_path / "two.ply", resolution=64).problems
    (problem,) = (p for p in problems if "within" in p)
    share, words = problem.split(" % of the surface lies within the object (parts that overlap, ")
    assert 18 < int(share) <= 25 and "unite the parts" in words


def test_a_double_sided_mesh_is_a_body(tmp_path):
    ball = CATALOGUE["ball"].mesh()
    both = trimesh.Trimesh(
        ball.vertices, np.concatenate([ball.faces, ball.faces[:, ::-1]]), process=False
    )
    (problem,) = check_mesh(saved(both, tmp_path), resolution=32).problems
    assert "double-sided" in problem


def test_a_mesh_of_a_metre_and_a_half_is_asked_about(tmp_path):
    (problem,) = check_mesh(
        saved(trimesh.creation.box(extents=(1.6, 0.4, 0.3)), tmp_path), resolution=32
    ).problems
    assert "1.6 m long" in problem and "is it in metres?" in problem


def test_faces_with_corners_that_there_are_not_are_refused(tmp_path):
    path = tmp_path / "bad.ply"
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        "0 0 0\n0.1 0 0\n0 0.1 0\n3 0 1 7\n"
    )
    with pytest.raises(VtgtsamError, match="faces with vertices 0 to 7, but it has 3 vertices"):
        check_mesh(path)
