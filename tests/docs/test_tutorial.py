# SPDX-License-Identifier: MIT
"""The tutorial's files and commands, taken from the page and run in its order."""

import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pandas as pd
import pytest

FOLDER = Path(__file__).parents[2] / "docs" / "tutorials"
PAGE = (FOLDER / "your-own-robot.md").read_text()
TIMEOUT = 300  # [s]


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)


def saved_as():
    """What the page says to save, by file name."""
    names = re.findall(r"[Ss]ave this as `([\w.]+)`", PAGE)
    (xml,), (yaml,) = blocks("xml"), blocks("yaml")
    assert names == ["hand.xml", "map.yaml"]
    return {"hand.xml": xml, "map.yaml": yaml}


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """Folder and output of each command, after all of them ran."""
    if find_spec("rerun") is None:
        pytest.skip("the tutorial opens the viewer (extra viz), which is not installed")
    folder = tmp_path_factory.mktemp("tutorial")
    shutil.copy(FOLDER / "practice_bag.py", folder)
    bin_folder = str(Path(sys.executable).parent)
    environment = {
        **os.environ,
        "PATH": f"{bin_folder}:{os.environ['PATH']}",
        "OMP_NUM_THREADS": "1",
    }
    outputs = {}
    for command in "".join(blocks("sh")).splitlines():
        if command == "cd robot":
            folder = folder / "robot"
            for name, text in saved_as().items():
                (folder / name).write_text(text)
            continue
        run = subprocess.run(
            command,
            shell=True,
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
        )
        assert run.returncode == 0, f"{command}\n{run.stdout}{run.stderr}"
        outputs[command] = run.stdout + run.stderr
    return folder, outputs


def output_of(outputs, start):
    (found,) = (text for command, text in outputs.items() if command.startswith(start))
    return found


def test_every_command_of_the_page_was_run(done):
    _, outputs = done
    assert [command.split()[:2] for command in outputs] == [
        ["python", "practice_bag.py"],
        *(["vtgtsam", name] for name in ("check-mesh", "inspect", "evaluate", "view", "convert")),
        ["vtgtsam", "inspect"],
    ]


def test_mesh_and_bag_have_no_problems(done):
    _, outputs = done
    assert "no problems found" in output_of(outputs, "vtgtsam check-mesh")
    for start in ("vtgtsam inspect bag", "vtgtsam inspect soap.mcap"):
        assert "no problems found" in output_of(outputs, start)


def test_errors_are_those_that_the_page_promises(done):
    folder, _ = done
    errors = pd.read_parquet(folder / "results" / "metrics.parquet")
    held = errors[errors["time_rel"] > 2.5].groupby("method")["translation_m"].median() * 1e3
    assert 5 < held["vis"] < 7  # [mm], "about 6 mm"
    assert held["vis+tac+pen"] < 2  # "within 2 mm"


def test_the_report_is_there(done):
    page = (done[0] / "results" / "report.html").read_text()
    assert "ADD-S" in page


def test_the_converted_bag_gives_the_same_errors(done):
    from vtgtsam import evaluate

    folder, _ = done
    methods = ["vis", "vis+pen", "vis+tac+pen", "vis+tac+pen+mem"]
    evaluate(folder / "soap.mcap", methods, "tuned", folder / "again")
    direct = pd.read_parquet(folder / "results" / "metrics.parquet")
    again = pd.read_parquet(folder / "again" / "metrics.parquet")
    pd.testing.assert_series_equal(again["adds_m"], direct["adds_m"], rtol=0, atol=1e-9)
    assert list(again["method"]) == list(direct["method"])


EXAMPLES = (
    r"\.\.\.|/[xy]\b|joints a, b|c, d|'camera'|\d[\d.]* (?:s|mm)\b|\d+|ahead of|\(joint angles\)"
)


def test_the_pages_messages_are_the_programs_own():
    """Each of a message's words, between the names and numbers of the example, is in the sources."""
    folder = FOLDER.parents[1] / "vtgtsam" / "recording"
    sources = "\n".join(path.read_text() for path in sorted(folder.rglob("*.py")))
    words = " ".join(re.sub(r'["\n]\s*f?"?', " ", sources).split())
    shown = re.findall(r"^\| `(.*?)` \|", PAGE, flags=re.MULTILINE)
    assert len(shown) > 5
    for message in shown:
        for part in re.split(EXAMPLES, message):
            part = part.strip(" ,;")
            assert part in words or part.removesuffix("the hand's") in words, part
