# SPDX-License-Identifier: MIT
"""The benchmark of calibrated robots: who is judged on what, and the tables."""

from pathlib import Path

import numpy as np
import pytest
from gripped_boxes import write_grip

from benchmarks import calibration
from benchmarks.calibration_report import LIMIT, ONLINE, figure, tables
from vtgtsam.exceptions import RecordingError

JUDGED = {
    "counts": (0, 2, 10),
    "methods": ("vis+tac+pen+mem",),
    "plain": ("vis+tac+pen",),
    "online": True,
}


def row(method, grasps, adds_mm, **more):
    known = {"robot has": "errors", "far": 0.0, "covered": 1.0}
    return {"method": method, "grasps": grasps, "adds_m": adds_mm / 1e3} | known | more


def offsets(nees):
    same = {"joints_rad": 0.01, "camera_rad": 0.01, "camera_m": 0.001, "left_out": {}, "seconds": 1}
    return {"nees": nees} | same


ROWS = [
    *(row("vis+tac+pen", 0, adds) for adds in (1.0, 2.0)),
    *(row("vis+tac+pen+mem", count, adds) for count in (0, 5) for adds in (1.0, 3.0)),
    row("vis+tac+pen+mem", 10, 0.5, **offsets(0.5)),
    row("vis+tac+pen+mem", 10, 0.7, **offsets(1.5)),
    row("vis+tac+pen+mem", LIMIT, 0.1),
    row("vis+tac+pen+mem", ONLINE, 0.8),
]


def test_no_robot_is_judged_on_its_earlier_grasps_and_one_has_no_error():
    paths = [Path(f"{n}.mcap") for n in range(6)]
    cases = list(calibration._imposed(paths, robots=2, tests=2, **JUDGED))
    assert [case.robot for case in cases] == [5000, 5001, None]
    for case in cases:
        assert len(case.tests) == 2 and len(case.earlier) == 4
        assert not set(case.tests) & set(case.earlier)
        assert case.counts == (0, 2)  # there are no ten
    assert cases[0].tests != cases[1].tests


def test_recordings_of_no_robot_cannot_be_judged_as_recorded(tmp_path):
    path = write_grip(tmp_path / "a.mcap", frames=5)
    with pytest.raises(RecordingError, match="of no robot with a number"):
        list(calibration._recorded([path], tests=1, **JUDGED))


def test_the_tables_have_a_row_a_method_and_number_of_grasps():
    errors, text = tables(ROWS)
    found = {(each["method"], each["earlier grasps"]): each for each in errors}
    assert len(found) == 6
    assert found["vis+tac+pen+mem", "5"]["median"] == 2.0
    assert found["vis+tac+pen+mem", "10"]["90 %"] == pytest.approx(0.68)
    assert found["vis+tac+pen+mem", "5"]["limit"] == pytest.approx(0.1)
    assert np.isnan(found["vis+tac+pen", "0"]["limit"])
    counts = [each["earlier grasps"] for each in errors if each["method"] == "vis+tac+pen+mem"]
    assert counts[:3] == ["0", "5", "10"]
    assert "|    1 |          1.5 |" in text  # NEES, mean and largest


def test_the_picture_has_the_limit_and_what_is_gained_while_it_works():
    (axes,) = figure(tables(ROWS)[0]).axes
    labels = {text.get_text() for text in axes.get_legend().get_texts()}
    assert labels == {"vis+tac+pen", "vis+tac+pen+mem", LIMIT, ONLINE}
    lines = {line.get_label(): line for line in axes.lines}
    np.testing.assert_allclose(lines["vis+tac+pen+mem"].get_ydata(), [2.0, 2.0, 0.6])
