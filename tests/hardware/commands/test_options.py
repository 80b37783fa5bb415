# SPDX-License-Identifier: MIT
from __future__ import annotations

import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
import typer

from hardware.commands import run as run_module
from hardware.commands.check import check

ROOT = Path(__file__).parents[3]


def python(code, text):
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        input=text,
        capture_output=True,
        text=True,
        timeout=60,
    )


def test_each_question_takes_one_line_and_leaves_the_next():
    code = "from hardware.commands.options import ask\nprint([ask('a? '), ask('b? '), ask('c? ')])"
    assert "['', 'two words', 'q']" in python(code, "\n two words\nq\n").stdout


def test_nobody_there_is_an_error_in_words():
    code = "from hardware.commands.options import ask\nask('a? ')"
    assert "nobody is there to press Enter" in python(code, "").stderr


def test_somebody_watches_until_the_answer_comes():
    code = (
        "import time\nfrom hardware.commands.options import ask\n"
        "start = time.monotonic()\n"
        "def watch():\n"
        "    if time.monotonic() - start > 0.5: raise SystemExit('overload')\n"
        "ask('a? ', watch)"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        process.wait(timeout=60)  # nobody ever types
        assert "overload" in process.stderr.read()
    finally:
        process.kill()
        process.communicate()


def test_check_without_ports_says_what_to_give(capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)  # where no calibrations lie
    with pytest.raises(typer.Exit) as end:
        check()
    assert end.value.exit_code == 1
    assert "give their port with --servos" in capsys.readouterr().out


@pytest.mark.parametrize(("seconds", "ends"), [(None, True), (15.0, False)])
def test_an_emulated_run_lasts_as_long_as_it_was_told(monkeypatch, seconds, ends):
    plans = []

    @contextmanager
    def emulated(plan, description, seed):
        plans.append(plan)
        yield None

    monkeypatch.setattr(run_module, "_emulated", emulated)
    monkeypatch.setattr(run_module, "_carry_out", lambda *arguments: None)
    run_module.run(object="can", emulate=True, seconds=seconds)
    assert plans[0].seconds == seconds
    assert plans[0].ends_after_grasp is ends
