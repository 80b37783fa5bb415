# SPDX-License-Identifier: MIT
"""One call at a time in a folder, and no worker that outlives the call."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from held_box import write_grasp

from vtgtsam import VtgtsamError, evaluate
from vtgtsam.evaluation import folder

linux = pytest.mark.skipif(sys.platform != "linux", reason="looks at processes in /proc")

HOLD = """
import sys, time
from pathlib import Path
from vtgtsam.evaluation.folder import in_use
with in_use(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""

WORK = """
import os, sys, time
from pathlib import Path
from vtgtsam.evaluation.engine import run_tasks

def work(task):
    Path(sys.argv[1], str(os.getpid())).touch()
    time.sleep(60)

if __name__ == "__main__":
    list(run_tasks(work, range(2), jobs=2))
"""


def begun(code: str, argument: Path) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-c", code, argument], stdout=subprocess.PIPE, text=True
    )


def until(condition, timeout=60.0) -> None:
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def runs(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state != "Z"


def test_a_second_call_into_the_same_folder_is_refused_and_names_the_first(tmp_path):
    recording = write_grasp(tmp_path / "0.mcap", frames=4)
    first = begun(HOLD, tmp_path / "out")
    try:
        assert first.stdout.readline() == "held\n"
        with pytest.raises(
            VtgtsamError, match=rf"is in use by another call \(process {first.pid}\)"
        ):
            evaluate(recording, ["vis"], "tuned", tmp_path / "out")
    finally:
        first.kill()
        first.communicate()


def test_the_lock_of_a_killed_call_is_gone_with_it(tmp_path):
    recording = write_grasp(tmp_path / "0.mcap", frames=4)
    first = begun(HOLD, tmp_path / "out")
    assert first.stdout.readline() == "held\n"
    first.kill()
    first.communicate()
    evaluate(recording, ["vis"], "tuned", tmp_path / "out")
    assert (tmp_path / "out" / "summary.csv").is_file()
    assert (tmp_path / "out" / folder.MARK / "lock").read_bytes() == b""


def test_two_threads_keep_each_other_out_as_well(tmp_path):
    with folder.in_use(tmp_path):
        problems = []

        def second():
            try:
                with folder.in_use(tmp_path):
                    pass
            except VtgtsamError as error:
                problems.append(str(error))

        thread = threading.Thread(target=second)
        thread.start()
        thread.join()
    assert "is in use" in problems[0]
    with folder.in_use(tmp_path):
        pass


@linux
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM])
def test_workers_end_with_the_process_that_started_them(tmp_path, how):
    parent = begun(WORK, tmp_path)
    until(lambda: len(list(tmp_path.iterdir())) == 2)
    workers = [int(path.name) for path in tmp_path.iterdir()]
    assert all(map(runs, workers))
    os.kill(parent.pid, how)
    parent.communicate()  # ends when nobody holds its output any more
    until(lambda: not any(map(runs, workers)), timeout=5)
