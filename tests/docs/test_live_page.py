# SPDX-License-Identifier: MIT
"""The how-to's programs run as they are printed, one after the other."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from vtgtsam.cli import app
from vtgtsam.estimate import Status
from vtgtsam.recording.topics import TopicMap

TEXT = (Path(__file__).parents[2] / "docs" / "how-to" / "live.md").read_text(encoding="utf-8")
PROGRAMS = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
NAMED = dict(re.findall(r'```python title="(\w+\.py)"\n(.*?)```', TEXT, re.DOTALL))


@pytest.fixture(scope="module")
def left():
    """What the programs have left."""
    found = {}
    for program in PROGRAMS:
        exec(compile(program, "live.md", "exec"), found)
    return found


def test_a_loop_of_ones_own_follows_a_tracker_that_is_80_ms_late(left):
    last = left["estimates"][-1]
    assert len(left["estimates"]) > 40
    truth = [0.10, 0.05 + 0.1 * last.time, 0.30]
    np.testing.assert_allclose(last.T_wo.translation(), truth, atol=1e-3)
    assert last.faults == ()


def test_the_map_is_one_that_is_read():
    (text,) = re.findall(r"```yaml\n(.*?)```", TEXT, re.DOTALL)
    topic_map = TopicMap.model_validate(yaml.safe_load(text))
    assert topic_map.topics.vision.frame == "camera"


def test_each_status_has_its_row_and_each_option_exists():
    for status in Status.__args__:
        assert f"| `{status}` |" in TEXT
    usage = CliRunner().invoke(app, ["ros", "--help"]).stdout
    for option in set(re.findall(r"vtgtsam ros (.*)", TEXT)):
        for name in re.findall(r"--[a-z-]+", option):
            assert name in usage or name == "--packages-select"


def test_a_recording_replays_by_the_program(tmp_path, monkeypatch):
    import gtsam

    from vtgtsam import load_hand, load_object
    from vtgtsam.recording import RecordingWriter
    from vtgtsam.recording.provenance import object_metadata

    hand = load_hand("isyhand")
    metadata = {**object_metadata(load_object("can")), "hand": "isyhand"}
    T_wo = gtsam.Pose3(gtsam.Rot3(), np.array([0.09, 0.15, 0.5]))
    with RecordingWriter(tmp_path / "grasp.mcap", metadata) as writer:
        writer.joint_states(0.0, hand.joint_names, np.zeros(len(hand.joint_names)))
        writer.tactile(0.0, hand.pad_names, np.zeros(len(hand)), np.zeros(len(hand)))
        writer.object_pose(0.0, T_wo)
        writer.estimate(0.0, T_wo)
    monkeypatch.chdir(tmp_path)
    found = {}
    exec(NAMED["replay.py"], found)
    assert found["estimates"][0].T_wo.equals(T_wo, 1e-3)
