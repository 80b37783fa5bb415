# SPDX-License-Identifier: MIT
"""``vtgtsam calibrate``, and ``vtgtsam evaluate`` with what it wrote."""

import pytest
import yaml
from gripped_boxes import HAND_XML, drawn, write_grip
from typer.testing import CliRunner

from vtgtsam import Calibration, evaluate
from vtgtsam.cli import app
from vtgtsam.exceptions import CalibrationError

ROBOT = drawn(4)
METHODS = ["vis", "vis+tac+pen+mem"]


def invoke(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Recordings, a calibration from two of them, and what the command said."""
    folder = tmp_path_factory.mktemp("calibrate")
    for seed in range(2):
        write_grip(folder / "grips" / f"{seed}.mcap", ROBOT, seed, 45)
    write_grip(folder / "new.mcap", ROBOT, seed=8)
    done = invoke("calibrate", folder / "grips", "--out", folder / "robot.yaml")
    assert done.exit_code == 0, done.output
    return folder, done


def test_it_writes_a_calibration_and_a_picture_and_says_what_it_found(made):
    folder, done = made
    calibration = Calibration.from_yaml(folder / "robot.yaml")
    assert (folder / "robot.png").read_bytes().startswith(b"\x89PNG")
    for words in (
        "2 grasps of hand gripper",
        "camera turn x",
        "j_yn",
        "believed before",
        "Not seen:",
        "NEES",
        "from now on",
        "--calibration",
    ):
        assert words in done.output
    assert calibration.hand == "gripper"
    assert calibration.covariance.shape == (10, 10)
    assert "first round: 2 of 2 recordings" in done.stderr


def test_it_replaces_nothing_unasked(made):
    folder, _ = made
    again = invoke("calibrate", folder / "grips", "--out", folder / "robot.yaml")
    assert again.exit_code == 1
    assert "is there already" in str(again.exception)


def test_an_evaluation_with_it_is_corrected_and_says_so(made, tmp_path):
    folder, _ = made
    plain = evaluate(folder / "new.mcap", METHODS, "tuned", tmp_path / "plain")
    file = folder / "robot.yaml"
    better = evaluate(folder / "new.mcap", METHODS, "tuned", tmp_path / "better", calibration=file)
    for method in METHODS:
        medians = [
            table[(table["method"] == method) & (table["phase"] == "all")]["adds_median_mm"].min()
            for table in (plain, better)
        ]
        assert medians[1] < 0.9 * medians[0]
    stored = yaml.safe_load((tmp_path / "better" / "config.yaml").read_text())
    assert stored["calibration"] == yaml.safe_load(file.read_text())
    assert yaml.safe_load((tmp_path / "plain" / "config.yaml").read_text())["calibration"] is None


def test_a_changed_calibration_is_noticed(made, tmp_path):
    folder, _ = made
    arguments = ["evaluate", folder / "new.mcap", "--out", tmp_path, "--methods", "vis"]
    first = invoke(*arguments)
    assert "done before" in invoke(*arguments).output
    changed = invoke(*arguments, "--calibration", folder / "robot.yaml")
    assert first.exit_code == changed.exit_code == 0
    assert "done before" not in changed.output


def test_a_recording_of_another_hand_fails_by_name(made, tmp_path):
    folder, _ = made
    other = HAND_XML.replace('"gripper"', '"tongs"')
    write_grip(tmp_path / "in" / "other.mcap", frames=10, hand_xml=other)
    done = invoke(
        *("evaluate", tmp_path / "in", "--out", tmp_path / "out", "--methods", "vis"),
        *("--calibration", folder / "robot.yaml"),
    )
    assert done.exit_code == 3
    assert "other: this calibration is of hand 'gripper', not of 'tongs'" in done.output


def test_a_calibration_that_is_none_ends_the_evaluation(made, tmp_path):
    folder, _ = made
    (tmp_path / "none.yaml").write_text("camera: 3\n")
    with pytest.raises(CalibrationError, match="none.yaml is no calibration"):
        evaluate(
            folder / "new.mcap",
            METHODS,
            "tuned",
            tmp_path / "o",
            calibration=tmp_path / "none.yaml",
        )
