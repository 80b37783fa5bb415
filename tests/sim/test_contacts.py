# SPDX-License-Identifier: MIT
import numpy as np
import pytest
import trimesh

from sim import contacts
from vtgtsam import ObjectModel
from vtgtsam.sdf.build import build_sdf


def cube(parts, monkeypatch):
    mesh = trimesh.creation.box((0.04, 0.04, 0.04))
    monkeypatch.setattr(contacts, "convex_parts", lambda mesh: parts)
    return ObjectModel("cube", build_sdf(mesh, resolution=16), mesh)


def corners(low, high):
    return np.array(trimesh.creation.box(bounds=[low, high]).vertices)


def test_parts_that_are_the_object_have_no_gap(monkeypatch):
    halves = [
        corners((-0.02, -0.02, -0.02), (0.0, 0.02, 0.02)),
        corners((0.0, -0.02, -0.02), (0.02, 0.02, 0.02)),
    ]
    gap = contacts.surface_gap(cube(halves, monkeypatch))
    assert gap.parts == 2
    assert gap.largest < 1e-6  # the cut between them, 20 mm inside, is no surface


def test_a_part_that_stands_out_by_a_millimetre_shows_it(monkeypatch):
    larger = [corners((-0.021, -0.021, -0.021), (0.021, 0.021, 0.021))]
    gap = contacts.surface_gap(cube(larger, monkeypatch))
    assert gap.mean == pytest.approx(1e-3, rel=0.1)
    assert 1e-3 <= gap.largest + 1e-9 < 1.8e-3  # sqrt(3) mm at the corners
