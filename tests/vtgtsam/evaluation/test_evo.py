# SPDX-License-Identifier: MIT
"""The genuine evo reads our TUM files and measures the errors that we measure."""

import json
import os
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from held_box import write_grasp

from vtgtsam import evaluate, read_recording

pytestmark = pytest.mark.skipif(find_spec("evo") is None, reason="evo is not installed (extra dev)")


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("evo")
    recording = write_grasp(folder / "box.mcap", frames=30)
    evaluate(recording, ["vis", "vis+tac+pen"], "tuned", folder / "out")
    times, poses = read_recording(recording).ground_truth
    rows = [
        [t, *T.translation(), *T.rotation().toQuaternion().coeffs()]
        for t, T in zip(times, poses, strict=True)
    ]
    np.savetxt(folder / "truth.txt", rows)
    return folder


def evo_ape(folder, method, relation):
    """What the command `evo_ape tum` says of a method."""
    estimate, stored = (
        folder / "out" / "tum" / method / "box.txt",
        folder / f"{method}{relation}.zip",
    )
    command = Path(sys.executable).with_name("evo_ape")
    subprocess.run(
        [command, "tum", str(folder / "truth.txt"), str(estimate)]
        + ["--pose_relation", relation, "--save_results", str(stored), "--no_warnings"],
        env={**os.environ, "HOME": str(folder), "MPLBACKEND": "agg"},  # evo writes settings there
        capture_output=True,
        check=True,
        timeout=120,
    )
    with zipfile.ZipFile(stored) as archive:
        return json.loads(archive.read("stats.json"))


@pytest.mark.parametrize("method", ["vis", "vis+tac+pen"])
def test_evo_measures_the_same_errors(result, method):
    metrics = pd.read_parquet(result / "out" / "metrics.parquet")
    metrics = metrics[metrics["method"] == method]
    # The box's centre is its origin, which is what evo measures at.
    translation = evo_ape(result, method, "trans_part")
    assert translation["mean"] == pytest.approx(metrics["translation_m"].mean(), rel=1e-6)
    assert translation["max"] == pytest.approx(metrics["translation_m"].max(), rel=1e-6)
    rotation = evo_ape(result, method, "angle_deg")
    expected = np.rad2deg(metrics["rotation_rad"].mean())
    assert rotation["mean"] == pytest.approx(expected, rel=1e-5)
