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
from collections.abc import Iterable, Mapping, Sequence
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
from .sequence import OF_SENSORS, SequenceName, Settings, make_alike, prepare

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
    return generate_alike({out: settings}, objects, grasps, noise_scales, jobs, progress)[out]


def generate_alike(
    runs: Mapping[Path, Settings],
    objects: Sequence[str],
    grasps: int,
    noise_scales: Sequence[float],
    jobs: int = 1,
    progress: Progress = _silent,
) -> dict[Path, list[Outcome]]:
    """Several datasets of the same grasps, each of which is simulated once, and filmed once by each camera.

    Args:
        runs: The folder to write to and the settings of each, which differ in ``sequence.OF_SENSORS`` alone.
        objects: As of ``generate``, like all others.
        grasps: Number of sequences of each object.
        noise_scales: Factors on the camera's noise.
        jobs: Processes to use.
        progress: Called after each object that was prepared and each sequence that was made.

    Returns:
        The outcomes of each folder.

    Raises:
        DatasetError: A folder holds sequences made with other settings.
        VtgtsamError: A worker process died.
        ValueError: The settings differ in what happens.
    """
    shared = _shared(runs.values())
    folders = {out: out / shared.dataset for out in runs}
    for out, folder in folders.items():
        _claim(folder, runs[out], noise_scales)
    names = [SequenceName(name, grasp) for name in objects for grasp in range(grasps)]
    outcomes = {
        (out, name): done
        for name in names
        for out, folder in folders.items()
        if (done := _done(folder, name, noise_scales))
    }
    total = len(names) * len(runs)
    for count, outcome in enumerate(outcomes.values(), 1):
        progress("sequences", count, total, str(outcome))
    missing = {name: [out for out in runs if (out, name) not in outcomes] for name in names}
    tasks = [(name, outs) for name, outs in missing.items() if outs]
    unusable = _prepare_all(shared, [name for name, _ in tasks], jobs, progress)
    make = partial(_make, runs, noise_scales, unusable)
    for made, outcome in run_tasks(make, tasks, jobs):
        for out in made:
            outcomes[out, outcome.name] = outcome
            progress("sequences", len(outcomes), total, str(outcome))
    for folder in folders.values():
        _write_rejected(folder)
    return {out: [outcomes[out, name] for name in names] for out in runs}


def _shared(runs: Iterable[Settings]) -> Settings:
    """The settings of several runs, without those of sensors."""
    default = asdict(Settings(""))
    kept = {
        Settings(**asdict(settings) | {name: default[name] for name in OF_SENSORS})
        for settings in runs
    }
    if len(kept) != 1:
        raise ValueError(
            f"expected settings that differ in {', '.join(OF_SENSORS)} alone, got {list(runs)}"
        )
    return kept.pop()


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
    runs: Mapping[Path, Settings],
    noise_scales: Sequence[float],
    unusable: dict[str, str],
    task: tuple[SequenceName, Sequence[Path]],
) -> tuple[Sequence[Path], Outcome]:
    """Make a sequence of some of the runs; these, and what became of it."""
    name, outs = task
    if unusable[name.object]:  # may be mended, so nothing is kept
        return outs, Outcome(name, problem=unusable[name.object])
    folders = {out: out / runs[out].dataset for out in outs}
    try:
        with ExitStack() as stack:
            parts = []
            for out, folder in folders.items():
                files = {s: recording_path(folder, name, s, noise_scales) for s in noise_scales}
                for path in files.values():  # what a killed run left; others may be at others
                    remove_leftovers(path)
                part = {s: stack.enter_context(replacing(path)) for s, path in files.items()}
                parts.append((runs[out], part))
            outcome = Outcome(name, make_alike(parts, name))
    except NotGraspable as error:
        outcome = Outcome(name, error.rejections, str(error))
    kept = {"rejections": outcome.rejections, "problem": outcome.problem}
    for folder in folders.values():
        write_text(folder / LOG / f"{name}.json", json.dumps(kept, sort_keys=True) + "\n")
    return outs, outcome


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
