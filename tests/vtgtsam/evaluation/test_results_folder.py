# SPDX-License-Identifier: MIT
"""A results folder is known by its mark, and only files that an evaluation made are replaced or removed."""

import json
import shutil
import sys
from pathlib import Path

import pytest
from held_box import write_grasp

from vtgtsam import VtgtsamError, cli, evaluate
from vtgtsam.evaluation import folder

METHODS = ["vis", "vis+pen"]
OWN = (  # what people keep beside results, in every place where results are
    "notes.md",
    "figures/paper.pdf",
    "figures/mine.png",
    "tum/mine.txt",
    "tum/vis/mine.txt",
    "bop/camera.json",
    "estimates/other.parquet",
    "metrics/other.parquet",
    ".draft.tmp",
    "figures/.editor.123.tmp",
    "estimates/.0.parquet.tmp",
    ".vtgtsam/mine.txt",
)


@pytest.fixture
def run(monkeypatch, capsys):
    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["vtgtsam", *map(str, arguments)])
        try:
            cli.main()
            code = 0
        except SystemExit as stopped:
            code = stopped.code or 0
        return code, *capsys.readouterr()

    return call


@pytest.fixture(scope="module")
def grasps(tmp_path_factory) -> Path:
    grasps = tmp_path_factory.mktemp("grasps")
    for seed in range(2):
        write_grasp(grasps / f"{seed}.mcap", seed=seed, frames=4)
    return grasps


def put(out: Path, names=OWN) -> dict[str, bytes]:
    """Write a person's files, and tell their content."""
    for name in names:
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_bytes(b"mine: " + name.encode())
    return {name: (out / name).read_bytes() for name in names}


def content(out: Path) -> dict[str, bytes]:
    paths = (path for path in out.rglob("*") if path.is_file())
    return {path.relative_to(out).as_posix(): path.read_bytes() for path in paths}


def as_older_versions_left_it(out: Path) -> None:
    shutil.rmtree(out / folder.MARK)


def test_a_persons_files_in_a_results_folder_stay_whatever_is_evaluated_there(
    run, grasps, tmp_path
):
    out = tmp_path / "out"
    run("evaluate", grasps, "--out", out, "--methods", "vis,vis+pen")
    own = put(out)
    for methods, recordings in (("vis", grasps / "0.mcap"), ("vis+pen", grasps)):
        assert run("evaluate", recordings, "--out", out, "--methods", methods)[0] == 0
        assert run("report", out)[0] == 0
    there = content(out)
    assert {name: there[name] for name in own} == own
    run("evaluate", grasps, "--out", tmp_path / "fresh", "--methods", "vis+pen")
    assert {name: there[name] for name in there if name not in own} == content(tmp_path / "fresh")


def test_a_folder_that_is_not_empty_is_refused_and_left_as_it_is(run, grasps, tmp_path):
    own = put(tmp_path / "out", ["notes.md", "figures/a.pdf"])
    code, out, err = run("evaluate", grasps, "--out", tmp_path / "out")
    assert (code, out) == (1, "")
    assert "holds figures, notes.md and was not made by vtgtsam" in err
    assert "--force" in err
    assert content(tmp_path / "out") == own


def test_with_force_the_persons_files_stay_all_the_same(run, grasps, tmp_path):
    own = put(tmp_path / "out")
    options = ("--out", tmp_path / "out", "--methods", "vis", "--force")
    assert run("evaluate", grasps, *options)[0] == 0
    there = content(tmp_path / "out")
    assert {name: there[name] for name in own} == own
    assert "summary.csv" in there


@pytest.mark.parametrize(
    "name", ["config.yaml", "summary.csv", "estimates/0.parquet", "report.html", "tum/vis/0.txt"]
)
def test_a_persons_file_where_a_result_would_go_is_named_and_not_replaced(
    run, grasps, tmp_path, name
):
    own = put(tmp_path / "out", [name])
    options = ("--out", tmp_path / "out", "--methods", "vis", "--force")
    code, _, err = run("evaluate", grasps, *options)
    assert code == 1
    assert f"{tmp_path / 'out' / name} is in the way" in err
    assert content(tmp_path / "out")[name] == own[name]


def test_a_configuration_that_lies_where_the_effective_one_goes_is_not_overwritten(
    grasps, tmp_path
):
    evaluate(grasps, ["vis"], "tuned", tmp_path)
    (tmp_path / "config.yaml").write_text("iterations: 3\n")
    with pytest.raises(VtgtsamError, match="where the effective settings are written"):
        evaluate(grasps, ["vis"], tmp_path / "config.yaml", tmp_path)
    assert (tmp_path / "config.yaml").read_text() == "iterations: 3\n"


def test_a_folder_of_an_older_version_needs_force_and_is_then_as_new(run, grasps, tmp_path):
    out = tmp_path / "out"
    run("evaluate", grasps, "--out", out, "--methods", "vis,vis+pen")
    as_older_versions_left_it(out)
    own = put(out, [name for name in OWN if not name.startswith(folder.MARK)])
    options = ("--out", out, "--methods", "vis")
    assert "or by an older version" in run("evaluate", grasps / "0.mcap", *options)[2]
    assert run("evaluate", grasps / "0.mcap", *options, "--force")[0] == 0
    there = content(out)
    assert {name: there[name] for name in own} == own
    run("evaluate", grasps / "0.mcap", "--out", tmp_path / "fresh", "--methods", "vis")
    assert {name: there[name] for name in there if name not in own} == content(tmp_path / "fresh")


def test_a_report_of_a_folder_of_an_older_version_needs_no_force(run, grasps, tmp_path):
    run("evaluate", grasps, "--out", tmp_path, "--methods", "vis,vis+pen")
    before, files = content(tmp_path), folder.made(tmp_path)
    as_older_versions_left_it(tmp_path)
    assert run("report", tmp_path)[0] == 0
    hidden = {name for name in files if name.startswith(folder.MARK)}
    assert folder.made(tmp_path) == files - hidden
    assert {name: content(tmp_path)[name] for name in files - hidden} == {
        name: before[name] for name in files - hidden
    }


def test_what_is_listed_is_what_was_made(grasps, tmp_path):
    evaluate(grasps, METHODS, "tuned", tmp_path)
    own = {f"{folder.MARK}/{name}" for name in ("files.json", "lock")}
    assert folder.made(tmp_path) == set(content(tmp_path)) - own


@pytest.mark.parametrize(
    "text", ["", "[]", '{"files": 3}', '{"files": {"../a": null}}', "[" * 10**5]
)
def test_a_damaged_list_is_named_and_nothing_is_removed(grasps, tmp_path, text):
    out = tmp_path / "out"
    put(tmp_path, ["a"])
    evaluate(grasps, ["vis"], "tuned", out)
    (out / folder.MARK / "files.json").write_text(text)
    before = content(tmp_path)
    with pytest.raises(VtgtsamError, match=r"files\.json, the list of .* is damaged"):
        evaluate(grasps, ["vis"], "tuned", out)
    assert content(tmp_path) == before
    evaluate(grasps, ["vis"], "tuned", out, force=True)
    assert "summary.csv" in folder.made(out)


def test_a_list_from_elsewhere_cannot_name_files_outside_through_a_link(grasps, tmp_path):
    out, elsewhere = tmp_path / "out", tmp_path / "elsewhere"
    own = put(elsewhere, ["a.png"])
    evaluate(grasps, ["vis"], "tuned", out)
    (out / "figures").symlink_to(elsewhere)
    names = dict.fromkeys([*folder.made(out), "figures/a.png"])
    (out / folder.MARK / "files.json").write_text(json.dumps({"files": names}))
    with pytest.raises(VtgtsamError, match="through a link"):
        evaluate(grasps, ["vis"], "tuned", out)
    assert content(elsewhere) == own


def test_results_in_the_place_of_a_file_are_refused(grasps, tmp_path):
    put(tmp_path, ["out"])
    with pytest.raises(VtgtsamError, match="out is a file; results need a folder"):
        evaluate(grasps, ["vis"], "tuned", tmp_path / "out")
