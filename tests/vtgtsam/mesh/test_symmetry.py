# SPDX-License-Identifier: MIT
"""Symmetries in BOP's form: read beside a mesh, given by a caller, moved with the origin."""

import json

import numpy as np
import pytest
import trimesh

from vtgtsam import load_object
from vtgtsam.exceptions import MeshError

HALF_TURN = [-1, 0, 0, 20, 0, -1, 0, 40, 0, 0, 1, 0, 0, 0, 0, 1]  # about z through (10, 20) mm
ABOUT_Z = {"axis": [0, 0, 1], "offset": [10, 20, 0]}


@pytest.fixture(autouse=True)
def empty_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("VTGTSAM_CACHE", str(tmp_path / "cache"))


@pytest.fixture
def folder(tmp_path):
    """BOP's folder of models: meshes in millimetres and their models_info.json."""
    box = trimesh.creation.box(extents=(60, 40, 90)).apply_translation((10, 20, 0))
    for number in (5, 6, 7):
        box.export(tmp_path / f"obj_{number:06}.ply")
    box.export(tmp_path / "box.ply")
    info = {
        "5": {"diameter": 116.0, "symmetries_discrete": [HALF_TURN]},
        "6": {"diameter": 116.0, "symmetries_continuous": [ABOUT_Z]},
        "7": {"diameter": 116.0},
    }
    (tmp_path / "models_info.json").write_text(json.dumps(info))
    return tmp_path


def load(path, **more):
    return load_object(path, scale=0.001, resolution=16, **more)


def test_the_entry_beside_a_mesh_is_read_by_its_number(folder):
    assert load(folder / "obj_000005.ply").symmetry == {"symmetries_discrete": [HALF_TURN]}
    assert load(folder / "obj_000006.ply").symmetry == {"symmetries_continuous": [ABOUT_Z]}
    assert load(folder / "obj_000007.ply").symmetry is None
    assert load(folder / "box.ply").symmetry is None


def test_a_symmetry_goes_with_the_origin(folder):
    turn = np.reshape(
        load(folder / "obj_000005.ply", origin="center").symmetry["symmetries_discrete"][0], (4, 4)
    )
    np.testing.assert_allclose(turn, np.diag([-1, -1, 1, 1]), atol=1e-9)
    moved = load(folder / "obj_000005.ply", origin=[0.01, 0, 0.03])
    turn = np.reshape(moved.symmetry["symmetries_discrete"][0], (4, 4))
    center = np.append(moved.center * 1e3, 1)
    np.testing.assert_allclose(turn @ center, center, atol=1e-9)
    (axis,) = load(folder / "obj_000006.ply", origin=[0.01, 0, 0.03]).symmetry[
        "symmetries_continuous"
    ]
    np.testing.assert_allclose(axis["offset"], (0, 20, -30), atol=1e-9)


def test_a_caller_gives_an_axis_an_entry_a_text_a_file_or_none(folder):
    path = folder / "box.ply"
    (axis,) = load(path, symmetry="z").symmetry["symmetries_continuous"]
    assert axis["axis"] == [0, 0, 1]
    np.testing.assert_allclose(axis["offset"], (10, 20, 0), atol=1e-4)
    expected = {"symmetries_discrete": [HALF_TURN]}
    one = folder / "one.json"
    one.write_text(json.dumps(expected))
    for given in (expected, json.dumps(expected), one, str(folder / "models_info.json#5")):
        assert load(path, symmetry=given).symmetry == expected
    assert load(folder / "obj_000005.ply", symmetry="none").symmetry is None


@pytest.mark.parametrize(
    ("symmetry", "message"),
    [
        ("w", "expected x, y, z, none, an entry"),
        ("{", "not valid JSON"),
        ("[]", "expected x, y, z, none, an entry"),
        ({"symmetries_discrete": [[1, 2, 3]]}, "is 16 numbers"),
        ({"symmetries_discrete": [[0] * 16]}, "no rotation with a translation"),
        ({"symmetries_discrete": [np.diag([1, 1, -1, 1]).ravel().tolist()]}, "no rotation"),
        ({"symmetries_continuous": [{"axis": [0, 0, 0]}]}, "the axis is zero"),
        ({"symmetries_continuous": [{"offset": [0, 0, 0]}]}, "axis"),
        ({"symmetries_continuous": 3}, "not iterable"),
        ("{folder}/models_info.json", "holds 3 objects; say which, like .*models_info.json#5"),
        ("{folder}/models_info.json#9", "no object '9'; it has: 5, 6, 7"),
        ("{folder}/box.ply", "cannot be read|not valid JSON"),
    ],
)
def test_what_is_no_symmetry_is_refused_in_a_sentence(folder, symmetry, message):
    if isinstance(symmetry, str):
        symmetry = symmetry.replace("{folder}", str(folder))
    with pytest.raises(MeshError, match=message):
        load(folder / "box.ply", symmetry=symmetry)


def test_a_damaged_file_beside_a_mesh_is_named(folder):
    (folder / "models_info.json").write_text('{"5": ')
    with pytest.raises(MeshError, match="models_info.json is not valid JSON"):
        load(folder / "obj_000005.ply")
