# SPDX-License-Identifier: MIT
"""Poses by other conventions than ours are refused with what to write, whatever the file's format."""

import gtsam
import numpy as np
import pytest
from test_instants import CAMERA, TIMES, attach, held, numbered, write

from vtgtsam.exceptions import RecordingError

OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
ASKEW = gtsam.Pose3(gtsam.Rot3.RzRyRx(1.0, 0.4, 0.9), np.zeros(3))


def askew(t):
    """The object stands askew, so that conventions differ."""
    return held(t) * ASKEW


def matrices(folder, change=lambda T: T):
    folder.mkdir()
    for k, t in enumerate(TIMES):
        np.savetxt(folder / f"{k:06d}.txt", change(CAMERA.between(askew(t)).matrix()))
    return folder


@pytest.fixture
def source(tmp_path, monkeypatch):
    monkeypatch.setattr("test_instants.held", lambda t: HELD(t) * ASKEW)
    return write(tmp_path / "a.mcap")


HELD = held


def rotated(T, R):
    other = T.copy()
    other[:3, :3] = R
    return other


CHANGES = {
    "as inverse poses, of the camera or the world in the object's frame; write their inverses": (
        np.linalg.inv
    ),
    "with their rotations transposed; transpose the rotations": lambda T: rotated(T, T[:3, :3].T),
    "for a camera that looks along -z .* write diag": lambda T: OPENGL @ T,
    "as inverse poses for a camera that looks along -z": lambda T: np.linalg.inv(OPENGL @ T),
    "are transposed, with the translation in the last row": lambda T: T.T,
    "are mirrored .their determinant is -1.00": lambda T: rotated(
        T, T[:3, :3] @ np.diag([1, 1, -1])
    ),
    "are scaled by 1e.03 .their determinant is 1e.09": lambda T: rotated(T, 1e3 * T[:3, :3]),
}


@pytest.mark.parametrize("words", CHANGES)
def test_another_convention_is_refused_with_what_to_write(tmp_path, source, words):
    with pytest.raises(RecordingError, match=words):
        attach(tmp_path, matrices(tmp_path / "m", CHANGES[words]), source)
    assert not (tmp_path / "out.mcap").exists()


def test_ours_is_taken_as_it_is(tmp_path, source):
    _, done = attach(tmp_path, matrices(tmp_path / "m"), source)
    assert done.warnings == []


def test_a_mesh_with_other_axes_gets_a_warning_that_names_the_turn(tmp_path, source):
    y_up = gtsam.Pose3(gtsam.Rot3.Rx(np.pi / 2), np.zeros(3)).matrix()
    _, done = attach(tmp_path, matrices(tmp_path / "m", lambda T: T @ y_up), source)
    (warning,) = done.warnings
    assert "turn the object by 90 degrees from the true pose" in warning
    assert "a mesh whose axes are turned by 90 degrees about (1.00, 0.00, 0.00)" in warning


def test_an_offset_beyond_the_objects_size_is_not_suggested(tmp_path, source):
    away = gtsam.Pose3(gtsam.Rot3(), [1.4, 0.0, 0.0]).matrix()
    _, done = attach(tmp_path, matrices(tmp_path / "m", lambda T: T @ away), source)
    assert "--offset" not in " ".join(done.warnings)
    assert "visual poses are off the true ones by 1400 mm" in done.warnings[0]


def test_numbers_in_order_need_no_motion(tmp_path, source):
    folder = numbered(tmp_path / "m", [CAMERA.between(askew(t)) for t in TIMES], range(len(TIMES)))
    times, _ = attach(tmp_path, folder, source)
    np.testing.assert_allclose(times, TIMES, atol=1e-6)
