# SPDX-License-Identifier: MIT
"""A dataset: many sequences, made in parallel, resumable, with a list of what was rejected.

Below ``out`` lies one folder a dataset, and in it ``<object>_<grasp>.mcap``; with several noise scales
these lie in a subfolder each. ``dataset.json`` says how they were made, ``log/`` has a file for each finished
sequence, and ``rejected.csv`` counts rejected samples by sequence and reason.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import logging
from collections import Counter
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Protocol

from vtgtsam.atomic import remove_leftovers, replacing, write_text
from vtgtsam.evaluation.engine import run_tasks
from vtgtsam.evaluation.resume import code_version
from vtgtsam.exceptions import VtgtsamError

from .sampling import NotGraspable
from .sequence import SequenceName, Settings, make_sequence, prepare

_log = logging.getLogger(__name__)

ABOUT, LOG, REJECTED = "dataset.json", "log", "rejected.csv"


class DatasetError(VtgtsamError):
    """The folder holds a dataset that was made otherwise."""


@dataclass(frozen=True)
class Outcome:
    """What became of a sequence.

    Attributes:
        name: The sequence.
        rejections: How often samples were rejected, by reason.
        problem: Why there is no such sequence, in one line; empty where there is.
        reused: Whether it was there already.
    """

    name: SequenceName
    rejections: Counter[str] = field(default_factory=Counter)
    problem: str = ""
    reused: bool = False

    def __str__(self) -> str:
        if self.problem:
            return f"{self.name}: failed: {self.problem}"
        rejected = self.rejections.total()
        word = "done before" if self.reused else "done"
        return f"{self.name}: {word}" + (f", {rejected} samples rejected" if rejected else "")


class Progress(Protocol):
    """Is told how far the work has come."""

    def __call__(self, stage: str, done: int, total: int, text: str) -> None:
        """What is being made, how many of it are done, and what became of the last one."""
        ...


def _silent(stage: str, done: int, total: int, text: str) -> None:
    pass


def generate(
    settings: Settings,
    objects: Sequence[str],
    grasps: int,
    noise_scales: Sequence[float],
    out: Path,
    jobs: int = 1,
    progress: Progress = _silent,
) -> list[Outcome]:
    """Make the sequences that are not there yet.

    Args:
        settings: What all sequences have in common.
        objects: Names of the objects.
        grasps: Number of sequences of each object.
        noise_scales: Factors on the camera's noise; the same grasps are recorded with each.
        out: Folder to write to, see above.
        jobs: Processes to use; the result does not depend on it.
        progress: Called after each object that was prepared and each sequence that was made.

    Returns:
        The outcomes in the order of objects and grasps.

    Raises:
        DatasetError: The folder holds sequences made with other settings.
        VtgtsamError: A worker process died.
    """
    folder = out / settings.dataset
    _claim(folder, settings, noise_scales)
    names = [SequenceName(name, grasp) for name in objects for grasp in range(grasps)]
    outcomes = {name: done for name in names if (done := _done(folder, name, noise_scales))}
    for count, outcome in enumerate(outcomes.values(), 1):
        progress("sequences", count, len(names), str(outcome))
    missing = [name for name in names if name not in outcomes]
    unusable = _prepare_all(settings, missing, jobs, progress)
    make = partial(_make, settings, noise_scales, folder, unusable)
    for outcome in run_tasks(make, missing, jobs):
        outcomes[outcome.name] = outcome
        progress("sequences", len(outcomes), len(names), str(outcome))
    _write_rejected(folder)
    return [outcomes[name] for name in names]


def _prepare_all(
    settings: Settings, missing: Sequence[SequenceName], jobs: int, progress: Progress
) -> dict[str, str]:
    """Compute what the sequences of an object share, once and not by each process.

    Returns:
        For each object why it cannot be simulated; empty where it can.
    """
    objects = list(dict.fromkeys(name.object for name in missing))
    problems: dict[str, str] = {}
    for name, problem in run_tasks(partial(_prepare, settings), objects, jobs):
        problems[name] = problem
        progress("objects", len(problems), len(objects), f"{name}: {problem or 'ready'}")
    return problems


def recording_path(
    folder: Path, name: SequenceName, scale: float, noise_scales: Sequence[float]
) -> Path:
    """Where a sequence's recording with that noise lies in the dataset's folder."""
    return (folder if len(noise_scales) == 1 else folder / f"noise_{scale:g}") / f"{name}.mcap"


def _claim(folder: Path, settings: Settings, noise_scales: Sequence[float]) -> None:
    """Write down how the folder's sequences are made, or refuse where others are in it."""
    about = asdict(settings) | {"noise": list(noise_scales)}
    del about["ycb"]  # where the meshes lie does not matter
    code = _code_version()
    file = folder / ABOUT
    if file.is_file():
        before = json.loads(file.read_text())
        if before.pop("code", code) != code:
            _log.warning(
                "%s was begun by another version of this code; what is there is kept", folder
            )
        before = asdict(Settings(settings.dataset)) | before  # an older one lacks newer settings
        changed = [f"{k} {before.get(k)}, now {v}" for k, v in about.items() if before.get(k) != v]
        if changed:
            raise DatasetError(
                f"{folder} was made with {'; '.join(changed)}: "
                "give another --out, or the settings it was made with"
            )
    write_text(file, json.dumps(about | {"code": code}, indent=2) + "\n")


def _code_version() -> str:
    """Version of the library and a hash of the simulator's sources."""
    digest = hashlib.sha256(code_version().encode())
    for source in sorted(Path(__file__).parent.rglob("*")):
        if source.suffix in (".py", ".yaml", ".xml"):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _done(folder: Path, name: SequenceName, noise_scales: Sequence[float]) -> Outcome | None:
    """The outcome of a sequence that was finished earlier, or None."""
    file = folder / LOG / f"{name}.json"
    if not file.is_file():
        return None
    found = json.loads(file.read_text())
    files = [recording_path(folder, name, scale, noise_scales) for scale in noise_scales]
    if not found["problem"] and not all(path.is_file() for path in files):
        return None
    return Outcome(name, Counter(found["rejections"]), found["problem"], reused=True)


def _prepare(settings: Settings, object_name: str) -> tuple[str, str]:
    """An object's name and what keeps it from being simulated, if anything."""
    try:
        prepare(settings, object_name)
    except VtgtsamError as error:
        return object_name, str(error)
    return object_name, ""


def _make(
    settings: Settings,
    noise_scales: Sequence[float],
    folder: Path,
    unusable: dict[str, str],
    name: SequenceName,
) -> Outcome:
    if unusable[name.object]:
        return Outcome(name, problem=unusable[name.object])  # may be mended, so nothing is kept
    files = {scale: recording_path(folder, name, scale, noise_scales) for scale in noise_scales}
    for path in files.values():  # what a killed run left; other runs may be at other sequences
        remove_leftovers(path)
    try:
        with ExitStack() as stack:
            parts = {scale: stack.enter_context(replacing(path)) for scale, path in files.items()}
            outcome = Outcome(name, make_sequence(settings, name, parts))
    except NotGraspable as error:
        outcome = Outcome(name, error.rejections, str(error))
    kept = {"rejections": outcome.rejections, "problem": outcome.problem}
    write_text(folder / LOG / f"{name}.json", json.dumps(kept, sort_keys=True) + "\n")
    return outcome


def _write_rejected(folder: Path) -> None:
    """A table of all rejected samples in the folder."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["sequence", "accepted", "reason", "count"])
    for file in sorted((folder / LOG).glob("*.json")):
        found = json.loads(file.read_text())
        for reason, count in sorted(found["rejections"].items()):
            table.writerow([file.stem, not found["problem"], reason, count])
    write_text(folder / REJECTED, text.getvalue())
