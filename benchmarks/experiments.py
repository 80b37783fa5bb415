# SPDX-License-Identifier: MIT
"""The paper's experiments with the paper's camera and with a stereo camera, on perfect and on imperfect robots.

    condition      camera    robot
    paper          paper     perfect, as in the paper
    paper-robot    paper     camera 2 mm and 1 degree off, joints 1 degree
    stereo         stereo    perfect
    stereo-robot   stereo    as above

Five robots (or, where they are perfect, seeds) each make a fifth of a dataset: one grasp of each object. An imperfect
one is judged as it is and after calibrating on five grasps of built-in objects. A part is one condition, dataset and
robot; what is there is not made again, so the same call goes on where an earlier one stopped, and parts may be asked
for one by one. Under all conditions a robot of the same number grasps alike: those that are asked for together are
recorded from one simulation.

Friction is dry, unless asked otherwise: with the paper's, what is held creeps by millimetres, which neither camera nor
touch sees.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from sim.datasets import generate, generate_alike
from sim.sequence import Settings
from vtgtsam import Calibration, calibrate, evaluate
from vtgtsam.evaluation.consistency import LEVELS, covered
from vtgtsam.evaluation.phases import AFTER
from vtgtsam.evaluation.significance import holm, signed_rank
from vtgtsam.exceptions import CalibrationError

from .report import save, table

CONDITIONS = ("paper", "paper-robot", "stereo", "stereo-robot")
METHODS = ("vis", "vis+pen", "vis+tac+pen", "vis+tac+pen+mem")
CALIBRATING = (
    "bottle",
    "pear",
    "brick",
    "cube",
    "gelatin_box",
)  # built in, none of the YCB objects
FIRST = 5000  # seeds and robots that no setting was chosen on
LARGE = 5.0  # [mm]
REFERENCE = "vis"


@dataclass(frozen=True)
class Part:
    """One robot's share of one dataset under one condition.

    Attributes:
        condition: One of ``CONDITIONS``.
        dataset: "vary" or "occ".
        robot: From 0.
        ycb: Directory of the objects' meshes; None for the built-in ones.
        friction: "dry", or "paper", with which held objects creep.
    """

    condition: str
    dataset: str
    robot: int
    ycb: str | None
    friction: str = "dry"

    @property
    def is_imperfect(self) -> bool:
        """Whether camera and joints are off."""
        return self.condition.endswith("-robot")

    def __str__(self) -> str:
        return f"{self.condition} {self.dataset} robot {self.robot}"

    def settings(self) -> Settings:
        """How its recordings are made."""
        return self._settings(self.dataset, FIRST + self.robot, self.ycb)

    def calibrating(self) -> Settings:
        """How the grasps on which its robot is calibrated are recorded."""
        return self._settings("vary", FIRST + 100 + self.robot, None)

    def _settings(self, dataset: str, seed: int, ycb: str | None) -> Settings:
        return Settings(
            dataset,
            seed=seed,
            tracker="depth-hand",
            ycb=ycb,
            camera=self.condition.removesuffix("-robot"),
            friction=self.friction,
            robot=FIRST + self.robot if self.is_imperfect else None,
        )

    def folder(self, out: Path) -> Path:
        """Where it lies."""
        return out / self.condition / self.dataset / f"robot_{self.robot}"


def run(parts: Sequence[Part], objects: Sequence[str], out: Path, jobs: int) -> None:
    """Make what is missing of some parts, and the tables of all that is there."""
    for alike in simulated_together(parts):
        print(", ".join(map(str, alike)), flush=True)
        runs = {part.folder(out) / "recordings": part.settings() for part in alike}
        generate_alike(runs, objects, 1, [1.0], jobs)
        for part in alike:
            judge(part, out, jobs)
    rows = list(summarised(out))
    save("experiments", table(rows), {"rows": rows}, {})


def simulated_together(parts: Sequence[Part]) -> list[list[Part]]:
    """The parts, put together where the same happens."""
    groups: dict[tuple[object, ...], list[Part]] = {}
    for part in parts:
        groups.setdefault((part.dataset, part.robot, part.ycb, part.friction), []).append(part)
    return list(groups.values())


def judge(part: Part, out: Path, jobs: int) -> None:
    """Evaluations of one part's recordings."""
    folder = part.folder(out)
    evaluate([folder / "recordings"], METHODS, "tuned", folder / "as_it_is", jobs=jobs)
    calibration = calibrated(part, out, jobs) if part.is_imperfect else None
    if calibration is not None:
        evaluate(
            [folder / "recordings"],
            METHODS,
            "tuned",
            folder / "calibrated",
            jobs=jobs,
            calibration=calibration,
        )


def calibrated(part: Part, out: Path, jobs: int) -> Calibration | None:
    """The robot's calibration from grasps of its own; None, and said so, where these are of no use.

    It is the same for both datasets.
    """
    folder = out / part.condition / "calibration" / f"robot_{part.robot}"
    file = folder / "calibration.yaml"
    if file.is_file():
        return Calibration.from_yaml(file)
    generate(part.calibrating(), CALIBRATING, 1, [1.0], folder / "recordings", jobs)
    try:
        found = calibrate(folder / "recordings")
    except CalibrationError as error:
        print(f"not calibrated: {error}", flush=True)
        return None
    found.to_yaml(file)
    return found


def summarised(out: Path) -> Iterator[dict[str, Any]]:
    """A row for each condition, dataset, state of calibration and method: errors after the turn."""
    for condition in CONDITIONS:
        for dataset in ("vary", "occ"):
            for state in ("as_it_is", "calibrated"):
                files = sorted((out / condition / dataset).glob(f"robot_*/{state}/metrics.parquet"))
                if files:
                    frames = pd.concat([_after(file) for file in files])
                    yield from _rows(frames, condition, dataset, state.replace("_", " "))


def _after(file: Path) -> pd.DataFrame:
    frames = pd.read_parquet(file)
    frames = frames[frames["phase"] == AFTER].copy()
    frames["recording"] = f"{file.parent.parent.name}/" + frames["sequence"].astype(str)
    return frames


def _rows(
    frames: pd.DataFrame, condition: str, dataset: str, state: str
) -> Iterator[dict[str, Any]]:
    frames["adds_mm"] = 1e3 * frames["adds_m"].fillna(np.inf)  # no pose is infinitely wrong
    medians = frames.groupby(["method", "recording"])["adds_mm"].median().unstack("method")
    methods = [method for method in METHODS if method in medians]
    p = _against(medians, [method for method in methods if method != REFERENCE])
    for method in methods:
        of_method = frames[frames["method"] == method]
        by_recording = of_method.groupby("recording")
        yield {
            "condition": condition,
            "dataset": dataset,
            "robot": state,
            "method": method,
            "grasps": len(medians),
            "ADD-S median [mm]": medians[method].median(),
            "90 % [mm]": medians[method].quantile(0.9),
            "frames > 5 mm": f"{(of_method['adds_mm'] > LARGE).mean():.1%}",
            "position [mm]": 1e3 * by_recording["translation_m"].median().median(),
            "rotation [deg]": np.degrees(by_recording["rotation_rad"].median().median()),
            "in 95 % region": _coverage(of_method),
            f"p against {REFERENCE} (Holm)": p.get(method, ""),
        }


def _against(medians: pd.DataFrame, methods: Sequence[str]) -> dict[str, str]:
    """P of the signed-rank test of each method's medians against the reference's, with Holm's correction."""
    if REFERENCE not in medians or not methods:
        return {}
    metres = 1e-3 * medians
    differences = {m: (metres[REFERENCE] - metres[m]).to_numpy() for m in methods}
    p = {m: signed_rank(d[np.isfinite(d)]).get("p") for m, d in differences.items()}
    tested = {m: value for m, value in p.items() if value is not None}
    corrected = holm(np.array(list(tested.values())))
    return {m: f"{value:.2g}" for m, value in zip(tested, corrected, strict=True)}


def _coverage(frames: pd.DataFrame) -> str:
    """Share of the frames whose truth is in the pose's 95 % region."""
    known = frames["nees"].notna()
    if not known.any():
        return ""
    inside = covered(
        frames["nees"][known].to_numpy(), frames["nees_dof"][known].to_numpy(), LEVELS[-1]
    )
    return f"{float(np.mean(inside)):.0%}"
