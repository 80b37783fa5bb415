# SPDX-License-Identifier: MIT
import sys

import pytest
from held_box import write_grasp

from vtgtsam import cli, extras


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


def made(out):
    """What is made for people to look at."""
    return {
        path.relative_to(out).as_posix(): path.read_bytes()
        for path in [out / "report.html", *sorted((out / "figures").iterdir())]
    }


def test_evaluate_ends_with_the_page_and_report_makes_the_same_again(run, tmp_path):
    write_grasp(tmp_path / "can_0.mcap", object="can", frames=12)
    out = tmp_path / "out"
    code, said, _ = run("evaluate", tmp_path / "can_0.mcap", "--out", out)
    assert code == 0
    assert f"To look at in a browser: {out / 'report.html'}" in said
    first = made(out)
    assert set(first) == {
        "report.html",
        *(f"figures/vary_depth_{kind}.png" for kind in ("methods", "pose_errors", "time")),
        *(f"figures/vary_depth_{kind}.png" for kind in ("worst_1", "coverage")),
    }
    (out / "figures" / "vary_depth_time.png").unlink()
    code, _, _ = run("report", out)
    assert code == 0
    assert made(out) == first


def test_figures_of_another_run_do_not_stay(run, tmp_path):
    write_grasp(tmp_path / "0.mcap", frames=6)
    out = tmp_path / "out"
    run("evaluate", tmp_path / "0.mcap", "--out", out)
    write_grasp(tmp_path / "0.mcap", frames=6, dataset="mine")
    run("evaluate", tmp_path / "0.mcap", "--out", out)
    assert {path.name.split("_")[0] for path in (out / "figures").iterdir()} == {"mine"}


def test_without_the_packages_all_else_is_made_and_one_sentence_says_what_to_install(
    run, tmp_path, monkeypatch
):
    there = extras._is_there
    monkeypatch.setattr(extras, "_is_there", lambda name: name != "jinja2" and there(name))
    write_grasp(tmp_path / "0.mcap", frames=6)
    out = tmp_path / "out"
    code, said, err = run("evaluate", tmp_path / "0.mcap", "--out", out)
    assert code == 0
    assert f"need jinja2: {extras.install_line('evaluate')}" in err
    assert said.endswith(f"All results are in {out}\n")
    assert (out / "tests.csv").is_file()
    assert not (out / "report.html").exists()
