# SPDX-License-Identifier: MIT
"""What a type checker says of settings, and so what an editor completes."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

PROGRAM = """\
from vtgtsam import EstimatorConfig

EstimatorConfig(iterations=3, w_vis=(10.0, 2000.0))
EstimatorConfig.tuned(method="vis+pen", recover=False)
EstimatorConfig.simulation(w_vis=4.0)
EstimatorConfig(iteratons=3)
EstimatorConfig.tuned(iteratons=3)
EstimatorConfig.simulation(iterations="many")
EstimatorConfig.real_world(method="vis+tac")
"""
RIGHT, WRONG = (3, 4, 5), (6, 7, 8, 9)  # lines


@pytest.mark.slow
def test_a_misspelt_setting_and_a_wrong_value_are_found_before_the_program_runs(tmp_path):
    if importlib.util.find_spec("mypy") is None:
        pytest.skip("mypy (extra dev) is not installed")
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    command = [sys.executable, "-m", "mypy", "--cache-dir", str(tmp_path / "cache")]
    settings = ["--config-file", str(ROOT / "pyproject.toml"), "--python-executable"]
    answer = subprocess.run(
        [*command, *settings, sys.executable, str(program)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=600,
    )
    found = {
        int(line.split(":")[1]) for line in answer.stdout.splitlines() if "program.py:" in line
    }
    assert found == set(WRONG), answer.stdout + answer.stderr
    assert "iteratons" in answer.stdout
