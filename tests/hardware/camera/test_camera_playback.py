# SPDX-License-Identifier: MIT
import numpy as np
import pytest

from hardware.camera.camera import CameraError, open_camera
from hardware.camera.playback import PacedCamera, RecordedCamera
from vtgtsam.camera import CameraIntrinsics
from vtgtsam.recording import RecordingWriter

INTRINSICS = CameraIntrinsics(32, 24, 30.0, 30.0, 15.5, 11.5)


def depth(k):
    return np.full((24, 32), 0.5 + 0.001 * k)


def color(k):
    return np.full((24, 32, 3), 10 * k, dtype=np.uint8)


@pytest.fixture
def recording(tmp_path):
    """Five depth images every 33 ms from 100 s; the colour image of the third is missing."""
    path = tmp_path / "images.mcap"
    with RecordingWriter(path) as writer:
        writer.camera_info(100.0, INTRINSICS)
        for k in range(5):
            if k != 2:
                writer.color(100.0 + 0.033 * k + 0.005, color(k))
            writer.depth(100.0 + 0.033 * k, depth(k))
    return path


def read_all(camera):
    with camera:
        frames = []
        while (frame := camera.read()) is not None:
            frames.append(frame)
        return frames


def test_a_recording_gives_its_images_back(recording):
    camera = RecordedCamera(recording)
    assert camera.intrinsics == INTRINSICS
    frames = read_all(camera)
    np.testing.assert_allclose([f.time for f in frames], 100.0 + 0.033 * np.arange(5), atol=1e-6)
    for k, frame in enumerate(frames):
        np.testing.assert_allclose(frame.depth, depth(k), atol=1e-6)
        if k == 2:
            assert frame.color is None  # the nearest one belongs to another instant
        else:
            np.testing.assert_allclose(frame.color, color(k), atol=3)  # JPEG


def test_a_recording_without_images_is_refused(tmp_path):
    with RecordingWriter(tmp_path / "none.mcap") as writer:
        writer.joint_states(0.0, ["a"], [0.1])
    with pytest.raises(CameraError, match="no message on /camera/info"):
        RecordedCamera(tmp_path / "none.mcap")


def test_an_image_of_another_size_is_refused(tmp_path):
    with RecordingWriter(tmp_path / "odd.mcap") as writer:
        writer.camera_info(0.0, INTRINSICS)
        writer.depth(0.0, np.ones((12, 16)))
    with pytest.raises(CameraError, match=r"shape \(12, 16\), /camera/info says \(24, 32\)"):
        RecordedCamera(tmp_path / "odd.mcap").read()


class FakeTime:
    """A clock that only moves when somebody sleeps."""

    def __init__(self):
        self.now = 5000.0
        self.slept = []

    def clock(self):
        return self.now

    def sleep(self, seconds):
        self.slept.append(seconds)
        self.now += seconds


def test_a_paced_recording_comes_when_it_is_due(recording):
    time = FakeTime()
    camera = PacedCamera(RecordedCamera(recording), time.clock, time.sleep)
    frames = read_all(camera)
    np.testing.assert_allclose([f.time for f in frames], 5000.0 + 0.033 * np.arange(5), atol=1e-6)
    np.testing.assert_allclose(time.slept, [0.033] * 4, atol=1e-6)


def test_images_asked_for_too_late_keep_the_stamp_at_which_they_were_due(recording):
    time = FakeTime()
    with PacedCamera(RecordedCamera(recording), time.clock, time.sleep) as camera:
        camera.read()
        time.now += 0.05
        assert camera.read().time == pytest.approx(5000.033)
        assert time.slept == []
        camera.read()  # 0.066, of which 0.05 are over
        np.testing.assert_allclose(time.slept, [0.016], atol=1e-6)


def test_images_that_nobody_asks_for_are_gone(recording):
    time = FakeTime()
    with PacedCamera(RecordedCamera(recording), time.clock, time.sleep) as camera:
        camera.read()
        time.now += 0.19  # 0.033, 0.066 are gone, 0.099 still waits
        assert camera.read().time == pytest.approx(5000.099)
        time.now += 10.0
        assert camera.read() is None


def test_a_camera_can_be_named_by_its_recording(recording):
    with open_camera(str(recording)) as camera:
        assert camera.intrinsics == INTRINSICS
        np.testing.assert_allclose(camera.read().depth, depth(0), atol=1e-6)


def test_an_unknown_camera_says_what_may_be_named():
    with pytest.raises(CameraError, match="no camera 'webcam': give realsense, realsense:SERIAL"):
        open_camera("webcam")
