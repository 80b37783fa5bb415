# SPDX-License-Identifier: MIT
import numpy as np
import pytest
import trimesh
from ycb import ycb_path

from vtgtsam import GridSdf, ObjectModel, VtgtsamError, load_object
from vtgtsam.mesh.reading import sha256_of
from vtgtsam.shapes import CATALOGUE, NAMES


@pytest.fixture(autouse=True, scope="module")
def cache_of_this_module(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("VTGTSAM_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture
def file_in_mm(tmp_path):
    """A pear in millimetres, off the origin."""
    mesh = CATALOGUE["pear"].mesh().apply_scale(1000).apply_translation([30, -20, 100])
    mesh.export(tmp_path / "pear_mm.obj", digits=12)
    return tmp_path / "pear_mm.obj"


def test_built_in_object_has_its_mesh_field_mass_and_symmetry():
    can = load_object("can")
    assert can.name == can.source == "can"
    assert can.mass == 0.349
    assert can.symmetry["symmetries_continuous"][0]["offset"] == [0, 0, 0]
    np.testing.assert_allclose(can.mesh.extents, [0.066, 0.066, 0.101], atol=1e-6)
    assert can.sdf.values.shape == (128, 128, 128)
    # On the axis the distance has a ridge, which the grid cuts off by up to its spacing of 1 mm.
    assert can.sdf.value([[0.0, 0.0, 0.0]])[0] == pytest.approx(-0.0315, abs=1e-3)
    assert can.scale == 1.0 and can.origin == (0.0, 0.0, 0.0)
    assert can.sha256 == sha256_of(can.mesh.vertices, can.mesh.faces)
    np.testing.assert_allclose(can.center, 0, atol=1e-7)
    assert repr(can) == "ObjectModel('can', 66 x 66 x 101 mm)"


def test_origin_and_scale_follow_their_formula(file_in_mm):
    origin = np.array([0.01, 0.02, 0.03])
    there = load_object(file_in_mm, scale=0.001, origin=origin)
    expected = 0.001 * trimesh.load_mesh(file_in_mm).vertices - origin
    np.testing.assert_allclose(np.sort(there.mesh.vertices, axis=0), np.sort(expected, axis=0))
    np.testing.assert_allclose(there.center, [0.02, -0.04, 0.07], atol=1e-6)
    assert there.scale == 0.001 and there.origin == (0.01, 0.02, 0.03)
    assert there.name == "pear_mm" and there.source == str(file_in_mm)
    assert there.symmetry is None and there.mass is None
    inside = there.sdf.value(there.center[None] - [[0, 0, 0.02]])
    assert inside[0] < -0.02


def test_center_is_the_middle_of_the_bounding_box(file_in_mm):
    there = load_object(file_in_mm, scale=0.001, origin="center")
    np.testing.assert_allclose(there.center, 0, atol=1e-12)
    np.testing.assert_allclose(there.origin, [0.03, -0.02, 0.1], atol=1e-6)
    again = load_object(file_in_mm, scale=there.scale, origin=there.origin)
    np.testing.assert_array_equal(again.mesh.vertices, there.mesh.vertices)
    assert again.sha256 == there.sha256


def test_hash_is_of_the_file_and_not_of_scale_and_origin(file_in_mm):
    one = load_object(file_in_mm, scale=0.001)
    two = load_object(file_in_mm, scale=0.002, origin="center")
    assert one.sha256 == two.sha256


def test_without_origin_the_file_keeps_its_own():
    banana = load_object(ycb_path("011_banana"))
    np.testing.assert_allclose(
        banana.mesh.bounds, trimesh.load_mesh(ycb_path("011_banana")).bounds, atol=1e-9
    )
    assert np.linalg.norm(banana.center) > 0.01
    assert banana.origin == (0.0, 0.0, 0.0)


def test_symmetry_of_a_built_in_object_moves_with_its_origin():
    padlock = load_object("padlock", origin=[0.0, 0.1, 0.0])
    turn = np.reshape(padlock.symmetry["symmetries_discrete"][0], (4, 4))
    center = np.array([0, -100, 0, 1])  # [mm]
    np.testing.assert_allclose(turn @ center, center, atol=1e-9)
    np.testing.assert_allclose(padlock.center, [0, -0.1, 0], atol=1e-7)


def test_unknown_name_lists_the_known_ones():
    with pytest.raises(VtgtsamError, match="teapot.*neither") as caught:
        load_object("teapot")
    assert all(name in str(caught.value) for name in NAMES)


def test_mesh_in_millimetres_is_refused_by_name_with_what_to_do(file_in_mm):
    with pytest.raises(VtgtsamError, match=r"pear_mm is 100 m long.*scale=0\.001"):
        load_object(file_in_mm)


@pytest.mark.parametrize("scale", [0, -1, np.nan, np.inf])
def test_scale_must_be_positive(scale):
    with pytest.raises(ValueError, match="scale"):
        load_object("ball", scale=scale)


@pytest.mark.parametrize("origin", ["middle", [0, 0], [0, 0, np.nan], 3.0])
def test_origin_must_be_three_numbers_or_center(origin):
    with pytest.raises(ValueError, match="origin must be three numbers"):
        load_object("ball", origin=origin)


def test_object_can_be_made_of_a_field_alone():
    sdf = GridSdf(np.ones((2, 2, 2)), [0, 0, 0], [0.1, 0.2, 0.4])
    lump = ObjectModel("lump", sdf)
    assert lump.mesh is None and lump.symmetry is None and lump.sha256 is None
    np.testing.assert_allclose(lump.center, [0.05, 0.1, 0.2])
    assert repr(lump) == "ObjectModel('lump', 100 x 200 x 400 mm)"


def test_a_resolution_can_be_given():
    assert load_object("ball", resolution=24).sdf.values.shape == (24, 24, 24)
    for wrong in (1, 12.5, "128"):
        with pytest.raises(ValueError, match="resolution must be a whole number of nodes"):
            load_object("ball", resolution=wrong)
    with pytest.raises(VtgtsamError, match="nodes of a distance field"):
        load_object("ball", resolution=5000)


def test_a_fields_file_is_an_object_without_a_mesh(tmp_path):
    ball = load_object("ball", resolution=24)
    ball.sdf.save(tmp_path / "ball.npz")
    alone = load_object(tmp_path / "ball.npz", origin=[0, 0, 0.01], symmetry="z")
    assert alone.mesh is None and alone.name == "ball"
    np.testing.assert_allclose(alone.sdf.lower, ball.sdf.lower - (0, 0, 0.01))
    np.testing.assert_allclose(
        alone.symmetry["symmetries_continuous"][0]["offset"][2], -10, atol=1e-6
    )
    with pytest.raises(ValueError, match="which is in metres: scale must be 1"):
        load_object(tmp_path / "ball.npz", scale=0.001)
    (tmp_path / "bad.npz").write_bytes(b"PK")
    with pytest.raises(VtgtsamError, match="not a distance field"):
        load_object(tmp_path / "bad.npz")


@pytest.mark.parametrize("wrong", [None, 3, ["can"], np.eye(3)])
def test_an_object_is_named_or_a_path(wrong):
    with pytest.raises(ValueError, match="given by its name or the path of its mesh, got"):
        load_object(wrong)


@pytest.mark.parametrize("scale", ["0.001", None, True])
def test_a_scale_of_another_type_is_refused(scale):
    with pytest.raises(ValueError, match="scale must be a positive number"):
        load_object("ball", scale=scale)


def test_an_object_of_other_things_is_refused_at_its_making():
    ball = load_object("ball", resolution=8)
    with pytest.raises(ValueError, match="sdf must be a GridSdf, got Trimesh; build_sdf makes"):
        ObjectModel("ball", ball.mesh)
    with pytest.raises(ValueError, match="mesh must be a trimesh.Trimesh or None, got str"):
        ObjectModel("ball", ball.sdf, "ball.obj")
    with pytest.raises(VtgtsamError, match="the axis is zero"):
        ObjectModel("ball", ball.sdf, symmetry={"symmetries_continuous": [{"axis": [0, 0, 0]}]})
