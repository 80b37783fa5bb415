# SPDX-License-Identifier: MIT
"""The programs and settings of how-to pages, run as they are printed."""

import json
import re
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from made_estimates import write_estimates
from typer.testing import CliRunner

from vtgtsam import EstimatorConfig, load_hand, load_object
from vtgtsam.cli import app
from vtgtsam.evaluation.lerobot import export_lerobot

HOW_TO = Path(__file__).parents[2] / "docs" / "how-to"


def blocks(page, language):
    text = (HOW_TO / page).read_text(encoding="utf-8")
    return re.findall(rf"```{language}[^\n]*\n(.*?)```", text, re.DOTALL)


@pytest.fixture(scope="module")
def recipes():
    """What the programs of the recipes have left, one after the other."""
    found = {}
    for program in blocks("recipes.md", "python"):
        exec(compile(program, "recipes.md", "exec"), found)
    return found


def test_mujocos_sites_are_pads(recipes):
    assert recipes["pads"].pad_names == ("pad_tip",)
    assert recipes["estimate"].status == "ok"
    assert abs(recipes["estimate"].pad_distances[0]) < 0.01


def test_foundationposes_matrix_comes_to_the_world(recipes):
    expected = recipes["T_wc"].transformFrom(np.array([0.02, -0.01, 0.55]))
    np.testing.assert_allclose(recipes["T_wo_visual"].translation(), expected, atol=1e-12)


def test_lerobots_columns_become_measurements(recipes, tmp_path):
    write_estimates(tmp_path / "in", "a_0", "can", np.arange(0.0, 1.0, 0.1))
    dataset = tmp_path / "out"
    export_lerobot(tmp_path / "in", dataset)
    # Joints, which our own export has none of, as LeRobot records them.
    info = json.loads((dataset / "meta/info.json").read_text())
    info["features"]["observation.state"] = {"dtype": "float32", "shape": [2], "names": ["a", "b"]}
    (dataset / "meta/info.json").write_text(json.dumps(info))
    (file,) = dataset.glob("data/*/*.parquet")
    table = pq.read_table(file)
    state = pa.array([[90.0, -45.0]] * len(table), pa.list_(pa.float32(), 2))
    pq.write_table(table.append_column("observation.state", state), file)
    found = list(recipes["measurements"](dataset, 0))
    assert len(found) == 10
    assert found[1].time == pytest.approx(0.1)
    assert found[1].joints == {"a": pytest.approx(np.pi / 2), "b": pytest.approx(-np.pi / 4)}
    assert found[1].contacts == {"pad_0": True, "pad_1": True, "pad_2": False}
    assert found[1].T_wo_visual.rotation().yaw() == pytest.approx(0.3, abs=1e-6)


def test_the_settings_of_the_page_on_weights_are_read(tmp_path, monkeypatch):
    (settings,) = blocks("weights.md", "yaml")
    (tmp_path / "my_robot.yaml").write_text(settings)
    monkeypatch.chdir(tmp_path)
    (program,) = blocks("weights.md", "python")
    found = {}
    exec(compile(program, "weights.md", "exec"), found)
    assert set(found["config"].differences()) == {"w_vis", "joint_sigma", "camera_sigma"}


def test_the_page_on_weights_says_the_recommended_ones():
    text = (HOW_TO / "weights.md").read_text()
    config = EstimatorConfig()
    said = {
        "w_vis": f"{config.visual_weights.rotation**-0.5:g} rad, {1e3 * config.visual_weights.translation**-0.5:g} mm",
        "joint_sigma": f"{np.degrees(config.joint_sigma):g} degree",
        "camera_sigma": f"{config.camera_sigma.rotation:g}, {1e3 * config.camera_sigma.translation:g} mm",
        "pad_sigma": f"{1e3 * config.pad_sigma:g} mm",
        "w_tac": f"{1e3 * config.w_tac**-0.5:g} mm",
        "w_pen": f"{1e3 * config.w_pen**-0.5:g} mm",
    }
    for name, value in said.items():
        (row,) = (line for line in text.splitlines() if line.startswith(f"| `{name}`"))
        assert row.split("|")[3].strip() == value
    assert f"| {config.log_theta_vis}, {config.log_theta_vis_mem} |" in text
    assert f"| {config.log_theta_tac} |" in text


def test_the_first_day_leads_to_a_first_pose(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("my_hand.xml").write_text(load_hand("isyhand").xml)
    load_object("mug").mesh.export("my_mug.obj")
    runner = CliRunner()
    suggest = ["suggest-pads", "my_hand.xml", "--out", "my_pads.yaml"]
    check = ["check-hand", "my_hand.xml", "--pads", "my_pads.yaml", "--out", "my_hand.png"]
    for command in (suggest, check, ["check-mesh", "my_mug.obj"]):
        assert " ".join(["vtgtsam", *command]) in (HOW_TO / "first-day.md").read_text()
        answer = runner.invoke(app, command)
        assert answer.exit_code == 0, answer.output
    (program,) = blocks("first-day.md", "python")
    exec(compile(program, "first-day.md", "exec"), {})
    printed = capsys.readouterr().out
    assert "t = 0.000 s: " in printed
    assert printed.count("mm from the surface") >= 10


def test_what_troubleshooting_quotes_is_said_somewhere():
    root = HOW_TO.parents[1]
    folders = ("vtgtsam", "sim", "hardware")
    sources = [path for folder in folders for path in (root / folder).rglob("*.py")]
    said = " ".join(path.read_text(encoding="utf-8") for path in sources)
    said = re.sub(r'"\s*\n\s*f?"', "", said)  # strings over several lines
    said += "vtgtsam: command not found"
    seen = 0
    for line in (HOW_TO / "troubleshooting.md").read_text().splitlines():
        for quoted in re.findall(r"`([^`]+)`", line.split("|")[1] if line.startswith("|") else ""):
            pieces = re.split(r"\.\.\.|NAME|\bN\b|0 of 16|\b6\b|mujoco|\[mjcf\]", quoted)
            for piece in filter(None, (piece.strip(" '") for piece in pieces)):
                if " " in piece:
                    assert piece in said, (line, piece)
                    seen += 1
    assert seen > 15
