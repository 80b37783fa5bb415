# SPDX-License-Identifier: MIT
"""What a command that is told to end leaves behind."""

import signal
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")

WAITS = """
import signal, sys, tempfile, time
from vtgtsam.commands.edge import edge
signal.signal(signal.SIGHUP, signal.SIG_IGN if sys.argv[2] == "ignored" else signal.SIG_DFL)
with edge("program"), tempfile.TemporaryDirectory(dir=sys.argv[1]):
    print("ready", flush=True)
    sys.stdin.read()
"""


def waiting(folder, hangups="told"):
    process = subprocess.Popen(
        [sys.executable, "-c", WAITS, folder, hangups],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdout.readline() == b"ready\n"
    assert list(folder.iterdir()) != []
    return process


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_command_that_is_told_to_end_removes_its_temporary_files_and_ends_by_the_signal(
    tmp_path, number
):
    with waiting(tmp_path) as process:
        process.send_signal(number)
        said = process.communicate(timeout=30)
    assert process.returncode == -number
    assert said == (b"", b"")
    assert list(tmp_path.iterdir()) == []


def test_a_hangup_that_nohup_ignores_stays_ignored(tmp_path):
    with waiting(tmp_path, "ignored") as process:
        process.send_signal(signal.SIGHUP)
        process.communicate(timeout=30)  # closes its input, at which it ends
    assert process.returncode == 0
