# SPDX-License-Identifier: MIT
"""After ``vtgtsam warm-up`` nothing is compiled any more."""

import os
import subprocess
import sys

import pytest

USED = """
import sys
from pathlib import Path
import numba
from numba.core.dispatcher import Dispatcher
compiled = []
compile = Dispatcher.compile
def noted(self, signature):
    before = len(self.overloads)
    result = compile(self, signature)
    if sum(self.stats.cache_misses.values()):
        compiled.append(self.py_func.__name__)
    return result
Dispatcher.compile = noted
from held_box import write_grasp
from vtgtsam import evaluate
from vtgtsam.warm_up import warm_up
warm_up()
folder = Path(sys.argv[1])
write_grasp(folder / "grasp.mcap")
evaluate(folder / "grasp.mcap", ["vis", "vis+tac+pen", "vis+tac+pen+mem"], "tuned", folder / "out")
print(sorted(set(compiled)))
"""


@pytest.mark.slow
def test_what_an_evaluation_and_a_tracker_run_is_compiled_beforehand(tmp_path):
    environment = os.environ | {
        "NUMBA_CACHE_DIR": str(tmp_path / "code"),
        "VTGTSAM_CACHE": str(tmp_path / "cache"),
        "PYTHONPATH": os.pathsep.join(sys.path),
    }
    command = [sys.executable, "-m", "vtgtsam", "warm-up"]
    first = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert first.stdout.splitlines()[-1].startswith("done in")
    second = subprocess.run(
        [sys.executable, "-c", USED, tmp_path], env=environment, capture_output=True, text=True
    )
    assert second.stdout.splitlines()[-1] == "[]", second.stdout + second.stderr
