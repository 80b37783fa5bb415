# SPDX-License-Identifier: MIT
"""The commands from end to end, short, without Theseus."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from held_box import write_grasp
from typer.testing import CliRunner

from benchmarks import (
    accuracy,
    breakdown,
    evaluation,
    field,
    problems,
    report,
    scaling,
    soak,
    speed,
)
from benchmarks.__main__ import app

ROOT = Path(__file__).parents[2]


@pytest.fixture
def results(tmp_path, monkeypatch):
    """Results go to a temporary folder, fields are coarse, and Theseus is absent."""
    cores = os.sched_getaffinity(0)  # the commands pin themselves to one
    fine = problems.lump
    monkeypatch.setattr(report, "RESULTS", tmp_path)
    monkeypatch.setattr(problems, "lump", lambda resolution=32, seed=0: fine(resolution, seed))
    for module in (accuracy, scaling, speed):
        monkeypatch.setattr(module, "absent", lambda: "no Theseus here")
    yield tmp_path
    os.sched_setaffinity(0, cores)


def run(*arguments):
    result = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    return result.output


def test_speed_measures_ours_alone_where_theseus_is_absent(results):
    output = run("speed", "--frames", "20")
    assert "no Theseus here" in output
    assert "vtgtsam fixed-damping" in output
    data = json.loads((results / "speed.json").read_text())
    assert data["machine"]["gtsam"]
    assert all(case["vtgtsam lm"]["median_ms"] > 0 for case in data["cases"].values())
    assert (results / "speed.png").stat().st_size > 1000


def test_accuracy_compares_with_the_reference_and_with_the_truth(results, monkeypatch):
    monkeypatch.setattr(accuracy, "OBJECTS", ("ball",))
    monkeypatch.setattr(accuracy, "COMPARED", 2)
    output = run("accuracy", "--frames", "20")
    data = json.loads((results / "accuracy.json").read_text())
    assert data["agreement"][0]["cost, relative"] < 1e-9
    assert data["agreement"][0]["pose after 5 steps [m, 1]"] < 1e-6
    errors = {
        row["solver"]: row["adds_median_mm"]
        for row in data["tracking"]
        if "tuned" in row["setting"]
    }
    assert errors["vtgtsam lm"] < errors["visual pose alone"]
    assert "ball" in output


def test_scaling_names_the_slope_of_each_curve(results, monkeypatch):
    sweep = scaling.Sweep("pads", (4, 8, 16), scaling._pads)
    monkeypatch.setattr(scaling, "SWEEPS", (sweep,))
    assert "slope" in run("scaling", "--frames", "20")
    data = json.loads((results / "scaling.json").read_text())
    assert len(data["pads"]["ms"]["vtgtsam lm"]) == 3
    assert (results / "scaling_pads.png").exists()


def test_breakdown_names_each_part_of_a_frame_with_caches_warm_and_emptied(results, monkeypatch):
    monkeypatch.setattr(breakdown, "CASES", ("tracked",))
    assert "searching closest points" in run("breakdown", "--frames", "20")
    data = json.loads((results / "breakdown.json").read_text())
    assert len(data["tracked"]) == 4
    for found in data["tracked"].values():
        assert all(found[part] > 0 for part in breakdown.PARTS)
        assert found["callbacks, calls"] > 10
        assert found["searching closest points, calls"] >= 5


def test_soak_reports_growth(results, monkeypatch):
    monkeypatch.setattr(soak, "CYCLE", 20)
    assert "memory grew by" in run("soak", "--frames", "100")
    assert len(json.loads((results / "soak.json").read_text())["samples"]) == 50


def test_field_is_compared_with_exact_distances_and_read_from_the_cache(results, monkeypatch):
    monkeypatch.setattr(field, "RESOLUTIONS", (8, 16, 32))
    monkeypatch.setattr(field, "POINTS", 200)
    monkeypatch.setattr(field, "REPEATS", 1)
    assert "with a hole" in run("field", "--largest", "32")
    data = json.loads((results / "field.json").read_text())
    assert [row["nodes a side"] for row in data["rows"]] == [8, 16, 32] * 2
    for row in data["rows"]:
        assert row["error at nodes"] < 1e-4
        assert row["right signs [%]"] == 100
    assert data["rows"][2]["error between nodes"] < 1
    assert (results / "field.png").stat().st_size > 1000


def test_evaluation_names_the_parts_the_speed_up_and_the_slope(results, monkeypatch, tmp_path):
    monkeypatch.setattr(evaluation, "SEQUENCES", (1, 2, 3))
    monkeypatch.setattr(evaluation, "JOBS", (1,))
    recordings = tmp_path / "recordings"
    recordings.mkdir()
    write_grasp(recordings / "one.mcap")
    assert "Slope in the number of sequences" in run("evaluation", "--recordings", str(recordings))
    data = json.loads((results / "evaluation.json").read_text())
    assert [row["sequences"] for row in data["batches"]] == [1, 2, 3]
    assert all(row["speed-up, whole call"] == 1 for row in data["batches"])
    assert all(data["parts"][0][part] > 0 for part in evaluation.PARTS)
    assert (results / "evaluation_parts.png").exists()


def test_an_expected_error_is_one_line_and_exit_code_1(tmp_path):
    (tmp_path / "no_recording.mcap").write_bytes(b"nothing")
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", "consistency", str(tmp_path)],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert done.stderr.startswith("benchmarks: ") and "no_recording.mcap" in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_solver_that_there_is_not_is_wrong_usage(results):
    result = CliRunner().invoke(app, ["soak", "--solver", "newton"])
    assert result.exit_code == 2
    assert "expected lm or fixed-damping, got newton" in result.output


@pytest.mark.slow
def test_the_first_estimate_on_a_new_machine_takes_seconds_and_later_ones_little(results):
    run("startup")
    first, code_kept, kept = json.loads((results / "startup.json").read_text())["rows"]
    assert first["together"] < 40  # 10 on a machine that does nothing else
    assert kept["together"] < first["together"] / 2
    assert kept["hand and object"] < first["hand and object"] / 2
    assert code_kept["estimator"] < first["estimator"] / 2
