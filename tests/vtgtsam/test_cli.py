# SPDX-License-Identifier: MIT
import os
import re
import subprocess
import sys

import pandas as pd
import pytest
import trimesh
from held_box import HAND_XML, write_grasp

import vtgtsam
from vtgtsam import GridSdf, cli


@pytest.fixture
def run(monkeypatch, capsys):
    """Run the command line in this process: exit code, stdout, stderr."""

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["vtgtsam", *map(str, arguments)])
        try:
            cli.main()
            code = 0
        except SystemExit as stopped:
            code = stopped.code or 0
        return code, *capsys.readouterr()

    return call


def test_help_takes_less_than_300_ms_and_lists_what_works():
    command = [sys.executable, "-c", "from vtgtsam.cli import main; main()", "--help"]
    durations = []
    for _ in range(5):
        before = os.times()
        answer = subprocess.run(command, capture_output=True, text=True, check=True)
        after = os.times()  # processor time, since other processes may be busy
        user, system = (getattr(after, n) - getattr(before, n) for n in _CHILDREN)
        durations.append(user + system)
    for name in ("evaluate", "report", "inspect", "view", "convert", "check-mesh", "sdf"):
        assert f"\n  {name}" in answer.stdout
    assert min(durations) < 0.3


_CHILDREN = ("children_user", "children_system")


def test_nothing_heavy_is_imported_for_help():
    code = (
        "import sys, vtgtsam.cli; "
        "print([m for m in ('numpy', 'gtsam', 'mujoco', 'pandas', 'rich') if m in sys.modules])"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert answer.stdout.strip() == "[]"


def test_every_command_answers_h_and_is_summarised_in_a_whole_sentence(run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    code, listed, _ = run("-h")
    commands = listed.split("Commands:")[1]
    assert code == 0 and "..." not in commands
    names = re.findall(r"^  ([a-z-]+)  +[A-Z]", commands, flags=re.MULTILINE)
    assert len(names) == len(cli.app.registered_commands)
    for name in names:
        assert run(name, "-h")[0] == 0


def test_commands_are_completed_by_the_shell():
    program = (
        "import sys; sys.argv[0] = 'vtgtsam'; from vtgtsam.cli import app; app(prog_name='vtgtsam')"
    )
    words = {
        "_VTGTSAM_COMPLETE": "complete_bash",
        "COMP_WORDS": "vtgtsam check-",
        "COMP_CWORD": "1",
    }
    command = [sys.executable, "-c", program]
    answer = subprocess.run(command, env=os.environ | words, capture_output=True, text=True)
    assert answer.stdout.split() == ["check-hand", "check-mesh"]


def test_version_says_what_it_is(run):
    assert run("--version") == (0, f"vtgtsam {vtgtsam.__version__}\n", "")


def test_evaluate_prints_a_table_in_mm_and_where_the_results_are(run, tmp_path):
    for name in ("can", "box"):
        write_grasp(tmp_path / "in" / f"{name}_0.mcap", object=name, frames=8)
    code, out, err = run("evaluate", tmp_path / "in", "--out", tmp_path / "out")
    assert code == 0
    lines = out.splitlines()
    assert lines[0] == "ADD-S [mm] of 2 sequences, dataset vary, tracker depth"
    assert lines[3].split() == [
        "object",
        "method",
        *"before turn after turn".split(),
        *"after turn after turn not held".split(),
    ]
    assert "With 2 sequences nothing can be said about chance: at least 6 are needed." in lines
    assert "Paired" not in out
    for word in ("vis: the visual tracker alone", "The turn is the hand's", "ADD-S: mean distance"):
        assert word in out
    summary = pd.read_csv(tmp_path / "out" / "summary.csv")
    median = summary.query("object == 'all' and method == 'vis' and phase == 'before'")
    row = next(line for line in lines if line.startswith("all objects (2)"))
    assert row.split()[3:5] == ["vis", f"{median['adds_median_mm'].iloc[0]:.2f}"]
    assert lines[-1] == f"All results are in {tmp_path / 'out'}"
    assert "[2/2] can_0: 8 frames" in err


def test_evaluate_prints_the_settings_that_are_not_the_recommended_ones(run, tmp_path):
    write_grasp(tmp_path / "0.mcap")
    config = tmp_path / "config.yaml"
    config.write_text("iterations: 3\nw_vis: [10, 2000]\nw_tac: 1.0e+6\nmethod: vis\n")
    arguments = ["evaluate", tmp_path / "0.mcap", "--methods", "vis", "--config"]
    code, output, _ = run(*arguments, config, "--out", tmp_path / "out")
    assert code == 0
    assert "Other than recommended: iterations = 3, w_vis = (10, 2000)\n" in output
    code, output, _ = run(*arguments, "tuned", "--out", tmp_path / "out")
    assert code == 0 and "recommended" not in output


def test_a_setting_that_is_gone_is_refused_in_one_sentence(run, tmp_path):
    write_grasp(tmp_path / "0.mcap")
    config = tmp_path / "config.yaml"
    config.write_text("engine: compiled\n")
    code, _, error = run("evaluate", tmp_path, "--config", config, "--out", tmp_path / "out")
    assert code == 1 and error.count("\n") == 1
    assert "the setting 'engine' is gone, leave it out" in error


def test_report_prints_the_same_table_without_estimating(run, tmp_path):
    write_grasp(tmp_path / "0.mcap", frames=8)
    _, first, _ = run("evaluate", tmp_path / "0.mcap", "--out", tmp_path / "out")
    stored = (tmp_path / "out" / "summary.csv").read_bytes()
    (tmp_path / "out" / "summary.csv").unlink()
    (tmp_path / "0.mcap").unlink()
    code, second, _ = run("report", tmp_path / "out")
    assert (code, second) == (0, first)
    assert (tmp_path / "out" / "summary.csv").read_bytes() == stored


def test_report_of_a_folder_without_results_says_so(run, tmp_path):
    code, _, err = run("report", tmp_path)
    assert code == 1
    assert "holds no finished evaluation" in err


def test_a_failed_sequence_gives_exit_code_3_and_is_listed(run, tmp_path):
    write_grasp(tmp_path / "in" / "good.mcap", frames=8)
    (tmp_path / "in" / "bad.mcap").write_bytes(b"nothing")
    code, out, err = run("evaluate", tmp_path / "in", "--out", tmp_path / "out")
    assert code == 3
    assert "1 of 2 sequences failed" in err
    assert "  bad: " in err
    assert "box (1)" in out


def test_where_all_sequences_fail_the_reason_comes_last_and_no_page_is_offered(run, tmp_path):
    (tmp_path / "bad.mcap").write_bytes(b"nothing")
    code, out, err = run("evaluate", tmp_path / "bad.mcap", "--out", tmp_path / "out")
    assert (code, out) == (3, "")
    assert err.splitlines()[-1].startswith("  bad: ")
    assert not (tmp_path / "out" / "report.html").exists()


def test_without_any_truth_it_says_why_there_is_no_table(run, tmp_path):
    write_grasp(tmp_path / "0.mcap", frames=4, truth=False)
    code, out, _ = run("evaluate", tmp_path / "0.mcap", "--out", tmp_path / "out")
    assert code == 0
    assert "no ADD-S to show" in out
    assert "no ground truth" in out


def test_a_hand_that_does_not_turn_has_one_median(run, tmp_path):
    write_grasp(tmp_path / "0.mcap", frames=6, turn=False)
    _, out, _ = run("evaluate", tmp_path / "0.mcap", "--out", tmp_path / "out")
    assert "turn" not in out.split("ADD-S:")[0]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("evaluate", "missing", "--out", "out"), "missing does not exist"),
        (("evaluate", ".", "--out", "out"), "no recordings in ."),
        (("inspect", "missing"), "missing does not exist"),
        (("sdf", "missing.obj", "--out", "x.npz"), "missing.obj"),
        (("check-mesh", "missing.obj"), "missing.obj"),
        (("report", "missing"), "holds no finished evaluation"),
    ],
)
def test_an_expected_error_is_one_line_and_exit_code_1(
    run, tmp_path, monkeypatch, arguments, sentence
):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(*arguments)
    assert (code, out) == (1, "")
    assert err.startswith("vtgtsam: ")
    assert err.count("\n") == 1
    assert sentence in err


@pytest.mark.parametrize(
    "arguments",
    [
        ("evaluate", "x"),
        ("evaluate", "x", "--out", "y", "--jobs", "0"),
        ("evaluate", "x", "--out", "y", "--methods", "vis,vision"),
        ("evaluate", "x", "--out", "y", "--methods", ""),
        ("unknown",),
        ("sdf", "mesh.obj"),
        ("check-mesh", "mesh.obj", "--scale", "0"),
    ],
)
def test_wrong_usage_is_exit_code_2(run, tmp_path, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    assert run(*arguments)[0] == 2


def test_a_mistake_of_the_program_shows_its_traceback_and_says_that_it_is_one(
    run, tmp_path, monkeypatch
):
    monkeypatch.setattr("vtgtsam.evaluation.tables.check_finished", lambda folder: 1 / 0)
    code, out, err = run("report", tmp_path)
    assert (code, out) == (1, "")
    assert "Traceback" in err
    assert "ZeroDivisionError" in err
    assert err.splitlines()[-1].startswith("vtgtsam: this is a fault of vtgtsam, not of what it")


def test_too_little_memory_is_one_sentence(run, tmp_path, monkeypatch):
    def greedy(folder):
        raise MemoryError

    monkeypatch.setattr("vtgtsam.evaluation.tables.check_finished", greedy)
    assert run("report", tmp_path) == (1, "", "vtgtsam: there is not enough memory for this\n")


def test_an_interrupted_evaluation_says_how_to_go_on(run, tmp_path, monkeypatch):
    def interrupted(*arguments, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr("vtgtsam.evaluation.run.run", interrupted)
    code, _, err = run("evaluate", tmp_path, "--out", tmp_path / "out")
    assert code == 130
    assert "goes on where it stopped" in err


def test_inspect_says_what_is_in_each_recording_of_a_folder(run, tmp_path):
    for name in "ab":
        write_grasp(tmp_path / f"{name}.mcap", frames=4)
    code, out, _ = run("inspect", tmp_path)
    assert code == 0
    assert out.count("/vision/object_pose") == 2
    assert "frames for the estimator: 4" in out


def test_inspect_exits_with_1_where_any_recording_has_a_problem(run, tmp_path):
    write_grasp(tmp_path / "a.mcap", frames=4, hand="", object_scale="x")
    write_grasp(tmp_path / "b.mcap", frames=4, truth=False)
    code, out, err = run("inspect", tmp_path)
    assert (code, err) == (1, "")
    assert out.count("  problem: ") == 1
    assert out.count("/vision/object_pose") == 2
    code, out, _ = run("inspect", tmp_path / "b.mcap")
    assert code == 0
    assert "note: no true poses" in out


def test_a_hand_given_on_the_command_line_replaces_the_recordings(run, tmp_path):
    (tmp_path / "hand.xml").write_text(HAND_XML.replace("pad_xp", "pad_zz"))
    recording = write_grasp(tmp_path / "0.mcap", frames=4)
    options = ("--hand", tmp_path / "hand.xml")
    code, _, err = run("evaluate", recording, "--out", tmp_path / "out", *options)
    assert code == 3
    assert "pad_zz" in err


def test_sdf_writes_a_field_that_loads(run, tmp_path):
    mesh = tmp_path / "ball.stl"
    trimesh.creation.icosphere(subdivisions=2, radius=30.0).export(mesh)
    field = tmp_path / "ball.npz"
    code, out, _ = run("sdf", mesh, "--out", field, "--scale", 0.001, "--resolution", 16)
    assert code == 0
    assert "16 x 16 x 16 nodes" in out
    value = GridSdf.load(field).value([[0.05, 0.0, 0.0]])[0]
    assert value == pytest.approx(0.02, abs=1e-3)  # the sphere's facets lie up to 0.6 mm inside it
    before = field.read_bytes()
    code, _, err = run("sdf", mesh, "--out", field)
    assert (code, "is there already; give another name, or --force" in err) == (1, True)
    assert field.read_bytes() == before
    code, _, err = run("sdf", mesh, "--out", mesh, "--force")
    assert (code, "--out must be another file than" in err) == (1, True)


def test_check_mesh_praises_a_good_mesh_and_says_what_is_wrong_with_a_bad_one(run, tmp_path):
    mesh = trimesh.creation.box(extents=[40.0, 50.0, 60.0])
    mesh.export(tmp_path / "box.stl")
    options = ("--resolution", 24)
    code, out, _ = run("check-mesh", tmp_path / "box.stl", "--scale", 0.001, *options)
    assert code == 0
    assert "no problems found" in out
    code, out, _ = run("check-mesh", tmp_path / "box.stl", *options)
    assert code == 1
    assert "millimetres" in out


def test_sdf_of_a_mesh_with_a_hole_warns_in_one_line(run, tmp_path):
    mesh = trimesh.creation.box(extents=[0.04, 0.05, 0.06])
    mesh.update_faces([True] * 11 + [False])
    mesh.export(tmp_path / "open.stl")
    options = ("--out", tmp_path / "open.npz", "--resolution", 12)
    code, _, err = run("sdf", tmp_path / "open.stl", *options)
    assert code == 0
    assert err.startswith("warning: ")
    assert err.count("\n") == 1
