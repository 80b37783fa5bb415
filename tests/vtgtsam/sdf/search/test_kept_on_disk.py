# SPDX-License-Identifier: MIT
import subprocess
import sys
from pathlib import Path

import numpy as np
from problems import lump_sdf, pads_around

from vtgtsam.sdf.search import ClosestPoints

SEARCH = """
import numpy as np
from problems import lump_sdf, pads_around
from vtgtsam.sdf.search import ClosestPoints
from vtgtsam.sdf.search.compiled_search import closest_on_pads

pads, T_wp = pads_around(0, count=3)
found = ClosestPoints(pads, lump_sdf(0)).search(np.eye(4), T_wp, np.ones(3, dtype=bool))
print(*found.indices, sum(closest_on_pads.stats.cache_misses.values()))
"""


def test_another_process_compiles_nothing():
    pads, T_wp = pads_around(0, count=3)
    found = ClosestPoints(pads, lump_sdf(0)).search(np.eye(4), T_wp, np.ones(3, dtype=bool))
    tests = str(Path(__file__).resolve().parents[3])
    command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {tests!r})\n{SEARCH}"]
    answer = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    assert answer.stdout.split() == [*map(str, found.indices), "0"]
