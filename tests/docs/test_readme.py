# SPDX-License-Identifier: MIT
"""The README is short, its program runs as it is printed, its figures are those that its commands stored."""

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = ROOT / "README.md"
TEXT = README.read_text(encoding="utf-8")
READMES = [README, *(ROOT / name / "README.md" for name in ("sim", "hardware", "benchmarks"))]


def test_the_program_of_the_readme_prints_an_estimate(capsys):
    (program,) = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
    assert len(program.splitlines()) <= 14
    found: dict[str, object] = {}
    exec(compile(program, str(README), "exec"), found)
    printed = capsys.readouterr().out
    assert printed == f"{found['estimate']}\n"
    assert printed.startswith("t = 0.000 s: ok")


def test_the_figures_are_those_that_the_named_commands_stored():
    def stored(name):
        return json.loads((ROOT / "benchmarks" / "results" / f"{name}.json").read_text())

    rows = {
        (row["condition"], row["when"], row["method"]): row for row in stored("memory")["phases"]
    }
    noisy = [rows["noise 4", "after", method] for method in ("vis", "vis+tac+pen+mem")]
    assert f"with {noisy[0]['recordings']} objects, hidden by the fingers" in TEXT
    assert "| {:.2f} | **{:.2f}** |".format(*(row["median [mm]"] for row in noisy)) in TEXT
    above = [row["above 5 mm [%]"] for row in noisy]
    assert f"| {above[0]:.0f} | **{above[1]:.1f}** |" in TEXT
    clear = [rows["noise 1", "after", method] for method in ("vis", "vis+tac+pen+mem")]
    assert "{:.2f} mm becomes {:.2f}".format(*(row["median [mm]"] for row in clear)) in TEXT
    times = {row["frame"]: row["median [ms]"] for row in stored("remembering")["rows"]}
    assert f"**{times['memory, uncertain joints and camera']:.1f}**" in TEXT


def test_it_can_be_read_in_a_few_minutes():
    prose = re.sub(r"```.*?```", "", TEXT, flags=re.DOTALL)
    assert len(prose.split()) < 700


@pytest.mark.parametrize("page", READMES, ids=lambda page: page.parent.name)
def test_what_a_readme_links_to_is_there(page):
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    links = re.findall(r"\]\(([^)\s]+)\)", text)
    local = [link.partition("#")[0] for link in links if not link.startswith(("http", "#"))]
    assert [link for link in local if not (page.parent / link).exists()] == []
