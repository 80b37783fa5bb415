# SPDX-License-Identifier: MIT
"""A short run of ``make fuzz``, and that it would notice."""

import os
import signal
import sys
import time

import numpy as np
import pytest

if sys.platform != "linux":
    pytest.skip("forks, and reads /proc", allow_module_level=True)

from fuzzing import child
from fuzzing.__main__ import fuzz
from fuzzing.kinds import KINDS
from fuzzing.kinds.kind import command, library
from fuzzing.mutate import mutated

SECONDS = 8.0  # for each kind, after its corpus


def test_all_is_well_where_nothing_happens(tmp_path):
    outcome = child.run(lambda: os.write(1, b"said\n") and "", tmp_path)
    assert outcome == child.Outcome("", "said\n")


def test_a_signal_an_exit_and_an_exception_are_noticed(tmp_path):
    for work, problem in (
        (lambda: os.kill(os.getpid(), signal.SIGSEGV), "SIGSEGV"),
        (lambda: os.abort(), "SIGABRT"),
        (lambda: 1 / 0, "ZeroDivisionError"),
        (lambda: sys.exit(3), "SystemExit"),
    ):
        assert problem in child.run(work, tmp_path).problem


def test_what_hangs_is_ended_and_noticed(tmp_path, monkeypatch):
    monkeypatch.setattr(child, "PATIENCE", 0.3)
    assert child.run(lambda: time.sleep(60), tmp_path).problem.startswith("it hangs")


def test_what_computes_for_ever_is_ended_and_noticed(tmp_path, monkeypatch):
    monkeypatch.setattr(child, "SECONDS", 1)
    assert child.run(lambda: str(sum(0 for _ in iter(int, 1))), tmp_path).problem.startswith(
        "it hangs"
    )


def test_what_takes_too_much_memory_is_noticed(tmp_path, monkeypatch):
    monkeypatch.setattr(child, "BYTES", 600 << 20)
    assert "GB" in child.run(lambda: str(np.ones(75 << 20).sum())[:0], tmp_path).problem
    assert "MemoryError" in child.run(lambda: str(np.ones(130 << 20).sum()), tmp_path).problem


def test_a_foreign_exception_and_a_traceback_are_noticed(capsys, monkeypatch):
    assert library(lambda: {}["a"]).endswith("KeyError: 'a'\n")
    assert library(lambda: open("/nowhere/at/all")) == ""
    monkeypatch.setattr("vtgtsam.evaluation.tables.check_finished", lambda folder: 1 / 0)
    assert "ZeroDivisionError" in command("report", "nowhere")


def test_the_same_seed_gives_the_same_bytes():
    first, second = (
        [mutated(b"a: [1, 2]\nb: {c: d}\n", [b"x: y"], np.random.default_rng(n)) for n in range(50)]
        for _ in range(2)
    )
    assert first == second
    assert len(set(first)) > 40


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_what_was_once_wrong_and_a_few_more_are_held(name):
    tried, findings = fuzz(name, seed=1, count=200, seconds=SECONDS)
    assert tried > 0
    assert [f"{label}: {outcome.problem}" for label, outcome in findings] == []
