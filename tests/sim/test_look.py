# SPDX-License-Identifier: MIT
import subprocess
import sys
from ctypes.util import find_library

import numpy as np
import pytest
from short_course import shorten

import sim.look
from sim import sequence
from sim.sequence import SequenceName, Settings, make_sequence

needs_graphics = pytest.mark.skipif(
    not (find_library("EGL") or find_library("OSMesa")),
    reason="neither EGL nor OSMesa to draw with",
)


@pytest.fixture
def recording(tmp_path, monkeypatch):
    shorten(monkeypatch)
    sequence._world.cache_clear()
    path = tmp_path / "box.mcap"
    make_sequence(Settings(dataset="vary"), SequenceName("gelatin_box", 0), {1.0: path})
    return path


def look(*arguments):
    command = [sys.executable, "-m", "sim", "look", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True)


@needs_graphics
def test_a_sheet_shows_both_views_of_each_instant(recording, tmp_path):
    # A process of its own: MuJoCo chooses how to draw when it is first imported.
    answer = look(recording, "--out", tmp_path / "sheet.png", "--instants", 2)
    assert answer.returncode == 0, answer.stderr
    from PIL import Image

    sheet = np.asarray(Image.open(tmp_path / "sheet.png")).astype(int)
    width, height = sim.look.SIZE
    assert sheet.shape == (2 * height, 2 * width, 3)
    blue = (sheet[..., 2] > sheet[..., 0] + 60).reshape(2, height, 2, width)
    assert (blue.sum(axis=(1, 3)) > 200).all()  # the object is in every picture
    empty = (sheet == sim.look.BACKGROUND).all(axis=-1).mean()
    assert 0.3 < empty < 0.98


def test_only_png_is_written(tmp_path):
    answer = look(tmp_path / "any.mcap", "--out", tmp_path / "film.avi")
    assert answer.returncode == 2
    assert "expected a .png file, got 'film.avi'" in answer.stderr


def test_without_graphics_the_packages_are_named(monkeypatch):
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(sim.look, "find_library", lambda name: None)
    with pytest.raises(sim.look.NoGraphics, match="apt-get install libegl1"):
        sim.look._choose_graphics()
