# SPDX-License-Identifier: MIT
"""What the first estimate on a machine costs: importing, compiling, a distance field, one frame; and a later process.

Each is a process of its own, and its time is that of all its threads, so that it does not depend on the other work of
the machine. "Nothing kept" is a machine on which the program has just been installed.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from .report import save, table

FIRST_ESTIMATE = """
import json, resource
def seconds():
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime
spent = {}
import gtsam
from vtgtsam import Measurement, PoseEstimator, load_hand, load_object
spent["importing"] = seconds()
hand, obj = load_hand("isyhand"), load_object("mug")
spent["hand and object"] = seconds()
estimator = PoseEstimator(hand, obj)
spent["estimator"] = seconds()
joints, contacts = dict.fromkeys(hand.joint_names, 0.0), [True] * len(hand)
estimator.update(Measurement(0.0, contacts, joints, T_wo_visual=gtsam.Pose3()))
spent["first frame"] = seconds()
print(json.dumps(spent))
"""
KEPT = {"nothing kept": (), "compiled code kept": ("code",), "all kept": ("code", "fields")}


def run() -> None:
    """Measure, and write ``startup.md`` and ``startup.json``."""
    rows = measure()
    text = "Processor time of a process up to its first estimate [s], by what earlier ones have left on the disk.\n\n"
    save("startup", text + table(rows), {"rows": rows}, {})


def measure() -> list[dict[str, Any]]:
    """A row a process: the time of each step [s], and the sum."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        first_estimate(Path(folder, "code"), Path(folder, "fields"))
        for title, kept in KEPT.items():
            with tempfile.TemporaryDirectory() as empty:
                code, fields = (
                    Path(folder if name in kept else empty, name) for name in ("code", "fields")
                )
                rows.append({"on the disk": title} | first_estimate(code, fields))
    return rows


def first_estimate(code: Path, fields: Path) -> dict[str, float]:
    """Processor time [s] of a process's steps up to its first estimate, with these folders as caches.

    Args:
        code: Where Numba keeps compiled code.
        fields: Where distance fields are kept.
    """
    answer = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", FIRST_ESTIMATE],
        cwd=Path(__file__).resolve().parents[1],
        env=os.environ | {"NUMBA_CACHE_DIR": str(code), "VTGTSAM_CACHE": str(fields)},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    total = json.loads(answer.stdout)
    steps = dict(zip(total, [0.0, *total.values()], strict=False))
    return {step: total[step] - steps[step] for step in total} | {"together": max(total.values())}
