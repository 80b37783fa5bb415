# SPDX-License-Identifier: MIT
import itertools
from types import SimpleNamespace

import gtsam
import numpy as np
import pytest

from hardware.camera.camera import Camera, CameraFrame
from hardware.camera.imager import LeftImager, LeftImages
from hardware.live import health
from hardware.servo.description import load_description


def test_what_has_no_port_is_not_checked_rather_than_wrong():
    description = load_description("isyhand")
    servos, pads = health.check_servos(description, None), health.check_pads(description, None)
    assert servos.lines() == ["servos: not checked; give their port with --servos"]
    assert pads.lines() == ["pads: not checked; give the board's port with --pads"]
    assert not servos.ok and not pads.ok


def test_a_port_that_is_not_there_is_wrong_and_said_once():
    finding = health.check_pads(load_description("isyhand"), "/dev/none")
    assert finding.lines()[0] == "pads on /dev/none: wrong"
    (problem,) = finding.problems
    assert "on /dev/none: No such file or directory; check" in problem
    assert "Errno" not in problem


class Streaming(Camera):
    """A camera whose every other frame has an infrared image, or one without a left imager."""

    def __init__(self, stereo):
        self.left = LeftImager(SimpleNamespace(), gtsam.Pose3()) if stereo else None
        self._number = itertools.count()

    def read(self):
        pixels, k = np.zeros((2, 2)), next(self._number)
        left = LeftImages(pixels, pixels if k % 2 else None) if self.left else None
        return CameraFrame(float(k), pixels, None, left)

    def close(self):
        pass


@pytest.mark.parametrize(
    ("stereo", "fact"), [(True, "infrared images beside 15 of 30: "), (False, "no infrared images: ")]
)  # fmt: skip
def test_a_camera_is_said_to_have_infrared_images_or_not(monkeypatch, stereo, fact):
    monkeypatch.setattr(health, "open_camera", lambda source: Streaming(stereo))
    finding = health.check_camera("film.db3")
    assert finding.ok  # a run does without
    assert finding.facts[-1].startswith(fact)
