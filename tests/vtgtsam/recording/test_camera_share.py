# SPDX-License-Identifier: MIT
"""Covariances of old simulated recordings, which hold the camera's error beside the tracker's own."""

import gtsam
import numpy as np
from gripped_boxes import write_grip

from vtgtsam import read_recording
from vtgtsam.recording.camera_share import camera_share, without_camera

T_WO = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.4, -0.2, 1.0), np.array([0.1, -0.05, 0.3]))


def test_the_share_is_the_spread_of_a_camera_that_is_off():
    rng = np.random.default_rng(0)

    def off():
        directions = rng.standard_normal((2, 3))
        turn, shift = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        error = gtsam.Pose3(gtsam.Rot3.Expmap(np.deg2rad(1.0) * turn), 0.002 * shift)
        return T_WO.localCoordinates(error.compose(T_WO))

    drawn = np.array([off() for _ in range(4000)])
    sigmas = np.sqrt(np.diag(camera_share(T_WO)))
    difference = drawn.T @ drawn / len(drawn) - camera_share(T_WO)
    assert np.abs(difference / np.outer(sigmas, sigmas)).max() < 0.06  # 4 of its sigmas


def test_what_was_added_is_taken_off():
    own = np.diag([4e-3] * 3 + [4e-4] * 3) ** 2
    np.testing.assert_allclose(without_camera(T_WO, own + camera_share(T_WO)), own, atol=1e-12)


def test_a_covariance_that_was_made_otherwise_is_none():
    assert without_camera(T_WO, np.diag([4e-3] * 3 + [4e-4] * 3) ** 2) is None


def test_measurements_have_the_trackers_own(tmp_path):
    old = read_recording(write_grip(tmp_path / "old.mcap", frames=30, old_covariances=True))
    new = read_recording(write_grip(tmp_path / "new.mcap", frames=30))
    assert old.covariance_holds_camera and not new.covariance_holds_camera
    for before, now in zip(old.measurements(), new.measurements(), strict=True):
        np.testing.assert_allclose(before.visual_covariance, now.visual_covariance, atol=1e-12)
    covariance = old.streams.vision.covariances[0]  # what `convert` writes on
    np.testing.assert_allclose(covariance, new.streams.vision.covariances[0], atol=1e-12)
