# SPDX-License-Identifier: MIT
"""What a run that calibrates keeps."""

import numpy as np
import pytest
from gripped_boxes import drawn, write_grip

from vtgtsam import Calibration, calibrate, read_recording
from vtgtsam.calibration.online import OnlineCalibration
from vtgtsam.calibration.sources import run_of
from vtgtsam.exceptions import CalibrationError
from vtgtsam.live.calibrating import kept

STARTED = "2026-05-01T10:00:00+00:00"


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    return read_recording(write_grip(path, drawn(4), seed=2, frames=100, started=STARTED))


@pytest.fixture(scope="module")
def online(recording):
    calibrating = OnlineCalibration(recording.hand, recording.object, background=False)
    for frame in recording.measurements():
        calibrating.update(frame)
    return calibrating


def test_what_a_run_has_learnt_is_in_a_file_to_go_on_from(online, tmp_path):
    path = tmp_path / "robot.yaml"
    said = kept(online, [], path)
    assert f"Wrote {path}" in said and "the camera is off by" in said
    found = Calibration.from_yaml(path)
    np.testing.assert_array_equal(found.offsets, online.calibration.offsets)
    np.testing.assert_array_equal(found.covariance, online.calibration.covariance)
    assert list(tmp_path.iterdir()) == [path]


def test_the_recording_of_the_run_is_not_counted_again(recording, online, tmp_path):
    path = tmp_path / "robot.yaml"
    kept(online, [run_of(recording.info)], path)
    with pytest.raises(CalibrationError, match="run: the same as the prior"):
        calibrate([recording.path], prior=path)
    another = write_grip(tmp_path / "b.mcap", drawn(4), seed=3, started="2026-05-01T11:00:00+00:00")
    assert len(calibrate(another, prior=path).made_from) == 2


def test_without_a_file_it_is_said_that_nothing_is_kept(online):
    assert "--calibration-out keeps it" in kept(online, [], None)


def test_a_run_that_learnt_nothing_writes_nothing(recording, tmp_path):
    known = Calibration.from_yaml(_written(recording, tmp_path))
    idle = OnlineCalibration(recording.hand, recording.object, prior=known, background=False)
    path = tmp_path / "robot.yaml"
    said = kept(idle, [], path)
    assert said == f"nothing was learnt of camera and joints: {path} is not written"
    assert not path.exists()


def _written(recording, folder):
    calibrate(recording).to_yaml(folder / "known.yaml")
    return folder / "known.yaml"
