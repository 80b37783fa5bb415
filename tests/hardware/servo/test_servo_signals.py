# SPDX-License-Identifier: MIT
"""What becomes of the torque when the program that drives the hand ends, in whatever way."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]

PROGRAM = """
import sys, time
from hardware.servo.description import load_description
from hardware.servo.hand import Hand
from hardware.stop_signals import stop_on_signals

with stop_on_signals(), Hand(load_description("isyhand"), sys.argv[1]) as hand:
    hand.configure()
    hand.enable()
    print("on", flush=True)
    for _ in range(1000):
        hand.state()
        time.sleep(0.02)
        if sys.argv[2] == "raise":
            raise RuntimeError("a mistake elsewhere")
        if sys.argv[2] == "exit":
            sys.exit(5)
        if sys.argv[2] == "hang":
            time.sleep(60)
"""


@pytest.fixture
def program(line):
    """Starts the program and waits until torque is on."""
    started = []

    def start(how="run"):
        process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, line.path, how],
            cwd=ROOT,
            env={**os.environ, "OMP_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        assert process.stdout.readline() == "on\n", process.stderr.read()
        return process

    yield start
    for process in started:
        process.kill()
        process.communicate()


def torques(line):
    return sum(servo.torque for servo in line.servos.values())


def end(process):
    return process.wait(timeout=10)


@pytest.mark.parametrize(
    ("number", "status"),
    [
        (signal.SIGINT, {-signal.SIGINT, 1, 130}),  # Python ends on KeyboardInterrupt
        (signal.SIGTERM, {128 + signal.SIGTERM}),
        pytest.param(signal.SIGHUP, {128 + signal.SIGHUP}, marks=pytest.mark.slow),
    ],
)
def test_a_signal_ends_torque(line, program, number, status):
    process = program()
    assert torques(line) == 15
    process.send_signal(number)
    assert end(process) in status
    assert torques(line) == 0


def test_impatient_signals_do_not_interrupt_the_way_out(line, program):
    process = program()
    line.faults.lost_instruction = 1.0  # the way out takes until this is over
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGTERM, signal.SIGINT):
        process.send_signal(number)
        time.sleep(0.05)
    assert torques(line) == 15
    line.faults.lost_instruction = 0.0
    assert end(process) == 128 + signal.SIGTERM
    assert torques(line) == 0


@pytest.mark.parametrize(
    ("how", "status"), [("raise", 1), pytest.param("exit", 5, marks=pytest.mark.slow)]
)
def test_an_exception_or_exit_ends_torque(line, program, how, status):
    assert end(program(how)) == status
    assert torques(line) == 0


@pytest.mark.parametrize("how", ["kill", "hang", "stop"])
def test_the_watchdogs_act_where_python_cannot(line, program, how):
    process = program("hang" if how == "hang" else "run")
    if how == "kill":
        process.kill()
    elif how == "stop":
        process.send_signal(signal.SIGSTOP)
    limit = time.monotonic() + 2.0
    while not all(servo.tripped for servo in line.servos.values()) and time.monotonic() < limit:
        time.sleep(0.01)
    assert all(servo.tripped for servo in line.servos.values())
