# SPDX-License-Identifier: MIT
"""Recorded sequences as problems, and recordings to time the evaluation with."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from vtgtsam import read_recording
from vtgtsam.frame import contact_bits, joints_of

from .problem import Problem

ROOT = Path(__file__).resolve().parents[1]


def as_problem(path: str | Path, **settings: Any) -> Problem:
    """A recording's frames with a visual pose and truth; each starts at that pose when solved by itself."""
    recording = read_recording(path)
    hand, sdf = recording.hand, recording.object.sdf
    frames = recording.measurements(rate="vision")
    truths = recording.truth_at([frame.time for frame in frames])
    known = [
        (frame, frame.T_wo_visual.matrix(), T_true.matrix())
        for frame, T_true in zip(frames, truths, strict=True)
        if frame.T_wo_visual is not None and T_true is not None
    ]
    T_visual = np.stack([T for _, T, _ in known])
    return Problem(
        values=sdf.values,
        lower=sdf.lower,
        upper=sdf.upper,
        points_p=hand.points_p,
        offsets=hand.offsets,
        T_wp=np.stack([hand.pad_transforms(joints_of(f, hand), f.T_wh) for f, _, _ in known]),
        contacts=np.stack([contact_bits(f.contacts, hand.pad_names) for f, _, _ in known]),
        T_visual=T_visual,
        T_true=np.stack([T for _, _, T in known]),
        T_start=T_visual,
        **({"w_vis": np.array([1.0, 1.0])} | settings),
    )


def simulate(folder: Path, objects: str = "can,mug", grasps: int = 1) -> None:
    """Record a few grasps of the simulator; half a minute each."""
    command = [sys.executable, "-m", "sim", "generate", "--dataset", "vary", "--out", str(folder)]
    command += ["--objects", objects, "--grasps", str(grasps)]
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
