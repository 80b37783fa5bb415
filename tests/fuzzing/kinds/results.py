# SPDX-License-Identifier: MIT
"""Files of a results folder."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from held_box import write_grasp

from vtgtsam import evaluate
from vtgtsam.evaluation import report
from vtgtsam.evaluation.tables import make_tables

from .kind import Kind, command, judged, library, run

_RESULTS = (
    "metrics.parquet", "sequences.csv", "config.yaml", "estimates/whole.parquet", "metrics/whole.parquet",
    ".vtgtsam/files.json", ".vtgtsam/parts/whole.json",
)  # fmt: skip


def _results(folder: Path) -> list[bytes]:
    write_grasp(folder / "whole.mcap", frames=6)
    evaluate(folder / "whole.mcap", ["vis", "vis+pen"], "tuned", folder / "results")
    return [(folder / "results" / name).read_bytes() for name in _RESULTS]


def _use_results(path: Path, folder: Path, rng: np.random.Generator) -> str:
    report.missing_packages = lambda: "figures are left out"  # they take seconds
    whole = (folder / "results" / "summary.csv").read_bytes()
    results = shutil.copytree(folder / "results", folder / "mutated")
    if rng.random() < 0.3:  # as older versions left it: nothing says what was made
        (results / ".vtgtsam" / "files.json").unlink()
    shutil.copy(path, results / next(n for n in _RESULTS if n.replace("/", "_") == path.name))
    sealed = (results / ".vtgtsam" / "files.json").is_file() and "json" not in path.name
    problem = library(lambda: make_tables(results)) or command("report", results)
    if not problem and sealed and (results / "summary.csv").read_bytes() != whole:
        return "a damaged folder gives another summary without a word"
    if problem or rng.random() < 0.8:
        return problem
    options = ("--out", results, "--methods", "vis,vis+pen", "--force")
    code, text = run("evaluate", folder / "whole.mcap", *options)
    problem = judged("evaluate", code, text)
    if not problem and code == 0 and (results / "summary.csv").read_bytes() != whole:
        problem = "evaluating again does not make the damaged folder good"
    return problem


RESULTS = Kind(tuple(n.replace("/", "_") for n in _RESULTS), _results, _use_results)
