# SPDX-License-Identifier: MIT
import sys

import numpy as np
import pytest
import trimesh

from sim import convex
from sim.convex import convex_parts
from vtgtsam.exceptions import VtgtsamError


@pytest.fixture(autouse=True)
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("VTGTSAM_CACHE", str(tmp_path))


def corner():
    """An L of two boxes, 60 x 60 x 20 mm."""
    wide = trimesh.creation.box(bounds=[(0, 0, 0), (0.06, 0.02, 0.02)])
    high = trimesh.creation.box(bounds=[(0, 0, 0), (0.02, 0.06, 0.02)])
    return trimesh.boolean.union([wide, high])


def holds(hull, points):
    """Which points lie behind every face of a convex part."""
    outside = np.einsum("pfk,fk->pf", points[:, None] - hull.triangles[:, 0], hull.face_normals)
    return (outside <= 0).all(axis=1)


def test_the_hull_of_a_convex_object_is_its_only_part():
    (part,) = convex_parts(trimesh.creation.icosphere(subdivisions=2, radius=0.03))
    np.testing.assert_allclose(np.linalg.norm(part, axis=1), 0.03)


def test_an_object_that_is_not_convex_is_cut_into_parts_that_fill_it():
    mesh = corner()
    parts = [trimesh.convex.convex_hull(points) for points in convex_parts(mesh)]
    assert len(parts) > 1
    assert sum(part.volume for part in parts) == pytest.approx(mesh.volume, rel=0.02)
    points = np.random.default_rng(0).uniform(0, (0.06, 0.06, 0.02), (2000, 3))
    inside = (points[:, 0] < 0.02) | (points[:, 1] < 0.02)
    covered = np.any([holds(part, points) for part in parts], axis=0)
    assert np.mean(covered == inside) > 0.98  # of the volume; the cut itself is exact to 1 %


def test_parts_are_the_same_every_time(tmp_path, monkeypatch):
    first = convex_parts(corner())
    monkeypatch.setenv("VTGTSAM_CACHE", str(tmp_path / "elsewhere"))
    for a, b in zip(first, convex_parts(corner()), strict=True):
        np.testing.assert_array_equal(a, b)


def test_parts_are_computed_once(monkeypatch):
    first = convex_parts(corner())
    monkeypatch.setattr(convex, "_compute", lambda mesh: pytest.fail("computed again"))
    for a, b in zip(first, convex_parts(corner()), strict=True):
        np.testing.assert_array_equal(a, b)


def test_without_coacd_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "coacd", None)
    with pytest.raises(VtgtsamError, match="pip install coacd"):
        convex_parts(corner())
