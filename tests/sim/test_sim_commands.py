# SPDX-License-Identifier: MIT
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest
from graphics_needed import needs_graphics
from typer.testing import CliRunner

from sim import datasets
from sim.__main__ import app
from sim.datasets import Outcome
from sim.objects import BUILT_IN, YCB, object_names
from sim.sequence import SequenceName
from vtgtsam.exceptions import MeshError
from vtgtsam.shapes import NAMES

ROOT = Path(__file__).parents[2]


@pytest.fixture
def calls(monkeypatch):
    """Stands in for the generation; answers with one sequence, and a failed one for the can."""
    found = []

    def generate(*arguments):
        found.append(arguments)
        settings, objects, *_, progress = arguments
        outcomes = [
            Outcome(
                SequenceName(name, 0), Counter({"slips": 2}), "too heavy" if name == "can" else ""
            )
            for name in objects
        ]
        for count, outcome in enumerate(outcomes, 1):
            progress("sequences", count, len(outcomes), str(outcome))
        return outcomes

    monkeypatch.setattr(datasets, "generate", generate)
    monkeypatch.delenv("VTGTSAM_YCB", raising=False)
    return found


def call(*arguments):
    return CliRunner().invoke(app, ["generate", *arguments])


@needs_graphics  # for --images
def test_options_become_settings(calls, tmp_path):
    result = call(
        *("--dataset", "occ", "--out", str(tmp_path), "--objects", "cube,mug", "--grasps", "2"),
        *("--seed", "9", "--jobs", "3", "--noise", "0.5,2", "--tracker", "depth-hand", "--images"),
        "--calibration-error",
    )
    assert result.exit_code == 0, result.output
    ((settings, objects, grasps, noise, out, jobs, _),) = calls
    assert (settings.dataset, settings.seed, settings.tracker) == ("occ", 9, "depth-hand")
    assert settings.images and settings.calibration_error and settings.ycb is None
    assert (objects, grasps, noise, out, jobs) == (("cube", "mug"), 2, [0.5, 2.0], tmp_path, 3)
    assert "2 of 2 sequences" in result.output
    assert "4 samples were rejected" in result.output
    assert "4 slips" in result.output
    assert "sequences 1/2  cube_0: done, 2 samples rejected" in result.output


def test_17_objects_and_5_grasps_are_the_default(calls, tmp_path):
    assert (
        call("--dataset", "vary", "--out", str(tmp_path), "--seed", "0").exit_code == 3
    )  # the can
    ((_, objects, grasps, noise, _, jobs, _),) = calls
    assert (len(objects), grasps, noise, jobs) == (17, 5, [1.0], 1)


def test_a_sequence_that_cannot_be_made_is_listed_and_the_exit_code_is_3(calls, tmp_path):
    result = call("--dataset", "vary", "--out", str(tmp_path), "--objects", "can,cube")
    assert result.exit_code == 3
    assert "1 of 2 sequences" in result.output
    assert "failed: can_0: too heavy" in result.output


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--dataset", "vry", "expected vary or occ"),
        ("--tracker", "color", "expected depth or depth-hand"),
        ("--noise", "1,x", "expected numbers of 0 or more"),
        ("--noise", "-1", "expected numbers of 0 or more"),
        ("--noise", "1,1", "twice"),
        ("--grasps", "0", "greater than or equal to 1"),
        ("--jobs", "0", "greater than or equal to 1"),
    ],
)
def test_wrong_usage_has_exit_code_2(calls, tmp_path, option, value, words):
    arguments = {"--dataset": "vary", "--out": str(tmp_path), option: value}
    result = call(*(word for pair in arguments.items() for word in pair))
    assert result.exit_code == 2
    assert words in result.output
    assert calls == []


def test_an_expected_error_is_one_line_and_exit_code_1(tmp_path, monkeypatch):
    monkeypatch.delenv("VTGTSAM_YCB", raising=False)
    arguments = ["--dataset", "vary", "--out", str(tmp_path), "--objects", "teapot"]
    done = subprocess.run(
        [sys.executable, "-m", "sim", "generate", *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert done.stderr.startswith("sim: no object teapot built in")
    assert done.stderr.count("\n") == 1


def test_the_17_objects_are_built_in_and_unknown_ones_refused(tmp_path):
    assert object_names(None, None) == BUILT_IN
    assert len(set(BUILT_IN)) == 17 and set(BUILT_IN) <= set(NAMES)
    with pytest.raises(MeshError, match="no object teapot built in"):
        object_names(["can", "teapot"], None)
    with pytest.raises(MeshError, match="is no directory"):
        object_names(None, tmp_path / "nothing")


@pytest.mark.skipif("VTGTSAM_YCB" not in os.environ, reason="VTGTSAM_YCB names no YCB meshes")
def test_the_17_ycb_objects_are_found():
    folder = Path(os.environ["VTGTSAM_YCB"])
    assert object_names(None, folder) == YCB
    assert len(set(YCB)) == 17
    assert object_names(["can", YCB[0]], folder) == ("can", YCB[0])


def generate_in_a_process(out, jobs):
    arguments = ["--dataset", "vary", "--out", str(out), "--objects", "cube", "--grasps", "2"]
    command = [sys.executable, "-m", "sim", "generate", *arguments, "--jobs", str(jobs)]
    return subprocess.Popen(command, cwd=ROOT, start_new_session=True)


@pytest.mark.slow
def test_two_processes_killed_in_the_middle_give_what_one_gives(tmp_path):
    assert generate_in_a_process(tmp_path / "one", jobs=1).wait() == 0
    killed = generate_in_a_process(tmp_path / "two", jobs=2)
    while killed.poll() is None and not list((tmp_path / "two").rglob(".*.tmp")):
        time.sleep(0.1)
    os.killpg(killed.pid, signal.SIGKILL)
    killed.wait()
    assert generate_in_a_process(tmp_path / "two", jobs=2).wait() == 0
    one, two = (
        {p.name: p.read_bytes() for p in (tmp_path / n).rglob("*.mcap")} for n in ("one", "two")
    )
    assert len(one) == 2
    assert one == two
    assert not list((tmp_path / "two").rglob("*.tmp"))
