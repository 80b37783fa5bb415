# SPDX-License-Identifier: MIT
"""Evaluate methods on recordings: each sequence by itself, then tables over all of them."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import pandas as pd
import yaml

from ..atomic import write_text
from ..config import EstimatorConfig
from ..exceptions import VtgtsamError
from . import folder, store
from .engine import run_tasks
from .errors import SCHEMA
from .exports import export
from .find import find_anywhere
from .given import Given
from .methods import load_config, method_configs
from .parquet import concatenate
from .remote import RemoteRecording, is_url
from .resume import code_version
from .sequence import Outcome, Task, evaluate_sequence
from .tables import Tables, make_tables, write_csv

if TYPE_CHECKING:
    from ..calibration.calibration import Calibration
    from ..hands.pads import PadSet
    from ..objects import ObjectModel
    from ..recording import TopicMap

    PathLike = str | os.PathLike[str]

logger = logging.getLogger(__name__)

DESCRIPTION = ("object", "dataset", "tracker", "noise_scale", "frames", "note")


def evaluate(
    recordings: PathLike | Iterable[PathLike],
    methods: Iterable[str],
    config: EstimatorConfig | PathLike,
    out: PathLike,
    jobs: int = 1,
    scheduler: str | None = None,
    hand: PadSet | PathLike | None = None,
    object: ObjectModel | PathLike | None = None,
    topics: TopicMap | PathLike | None = None,
    force: bool = False,
    calibration: Calibration | PathLike | None = None,
) -> pd.DataFrame:
    """Estimate the object's pose in recorded sequences and compare with the truth.

    Everything is written to ``out``: estimates, errors, tables, trajectories for other tools (figures
    and a page to look at are made of them by the command ``vtgtsam report``). What is there
    already and was made from the same recording, settings and code is not computed again, so an interrupted
    call goes on where it stopped; what an earlier call made and does not belong to this one is removed, and
    no other file. The result does not depend on ``jobs``.

    A sequence that fails is logged and listed in ``sequences.csv``, the others are kept. A recording without
    ground truth is estimated and has no errors.

    Args:
        recordings: ``.mcap`` files, rosbag2 folders, or folders that are searched for both; or URLs of
            such that fsspec can open ("s3://bucket/folder"), whose files are fetched one sequence at a time.
        methods: Names of methods, such as "vis", "vis+pen", "vis+tac+pen".
        config: Settings of the estimator, whose ``method`` is replaced by each name; or a preset's name
            ("simulation", "real_world", "tuned"); or a YAML file.
        out: The run's folder, on this machine or one that all workers share.
        jobs: Processes on this machine.
        scheduler: Address of a Dask scheduler whose workers to use instead, "tcp://HOST:PORT"; they must
            see the same paths.
        hand: Hand to use instead of the one a recording names, or its name or file.
        object: Object to use instead of the one a recording names, or its name or mesh file.
        topics: Topic map of other people's bags, or its YAML file.
        force: Use a folder that is neither empty nor a run's; files that were not made here stay as they are.
        calibration: Where the robot's camera and its joints' zeros are, or its YAML file; it corrects what every
            method gets, and a recording of another hand or camera fails.

    Returns:
        The summary, as in ``summary.csv``: a row for each dataset, object, method and phase, in mm. Errors
        of single frames are in ``metrics.parquet``. ``attrs["failed"]`` maps a failed sequence to the reason.

    Raises:
        VtgtsamError: A path, the configuration or the map is wrong; ``out`` holds other files; or a worker died.
        ValueError: A method is unknown.
    """
    tables = run(
        recordings,
        methods,
        config,
        out,
        jobs,
        scheduler,
        hand,
        object,
        topics,
        force,
        calibration=calibration,
    )
    for sequence, problem in tables.failed.items():
        logger.warning("%s failed: %s", sequence, problem)
    tables.summary.attrs["failed"] = tables.failed
    return tables.summary


def run(
    recordings: PathLike | Iterable[PathLike],
    methods: Iterable[str],
    config: EstimatorConfig | PathLike,
    out: PathLike,
    jobs: int = 1,
    scheduler: str | None = None,
    hand: PadSet | PathLike | None = None,
    obj: ObjectModel | PathLike | None = None,
    topics: TopicMap | PathLike | None = None,
    force: bool = False,
    progress: Callable[[Outcome, int], None] | None = None,
    calibration: Calibration | PathLike | None = None,
) -> Tables:
    """As ``evaluate``, with all tables as the answer.

    ``progress`` is called after each sequence with its outcome and the number of sequences in all.
    """
    if jobs < 1:
        raise ValueError(f"jobs must be at least 1, got {jobs}")
    paths = [recordings] if isinstance(recordings, str | os.PathLike) else recordings
    if is_url(out):
        raise VtgtsamError(f"results need a folder, on this machine or a shared one, not {out}")
    found = find_anywhere(paths)
    configs = method_configs(methods, load_config(config))
    given = Given.of(hand, obj, topics, calibration)
    place = Path(out).resolve()  # workers may have another current folder
    _spare(place / store.CONFIG, config)
    with folder.in_use(place, force):
        return _run(place, found, configs, given, jobs, scheduler, progress)


def _run(
    out: Path,
    found: Mapping[str, Path | RemoteRecording],
    configs: Mapping[str, EstimatorConfig],
    given: Given,
    jobs: int,
    scheduler: str | None,
    progress: Callable[[Outcome, int], None] | None,
) -> Tables:
    _prepare(out, set(found))
    tasks = [
        Task(sequence, recording.resolve(), out, configs, given, code_version())
        for sequence, recording in found.items()
    ]
    outcomes: dict[str, Outcome] = {}
    for outcome in run_tasks(evaluate_sequence, tasks, jobs, scheduler):
        outcomes[outcome.sequence] = outcome
        if progress is not None:
            progress(outcome, len(tasks))
    folder.claim(out, [store.CONFIG])
    write_text(out / store.CONFIG, _config_yaml(configs, given))
    ordered = [outcomes[sequence] for sequence in found]
    return _collect(out, ordered, list(configs), jobs, scheduler)


def _spare(effective: Path, given: EstimatorConfig | PathLike) -> None:
    """Refuse to write the effective settings over the ones that were given."""
    if isinstance(given, str | os.PathLike) and Path(given).resolve() == effective:
        raise VtgtsamError(
            f"{effective} is where the effective settings are written; "
            "give the configuration under another name, or another folder for the results"
        )


def _prepare(out: Path, sequences: set[str]) -> None:
    """Remove what is left of a killed run, and results that do not belong to this call."""
    parts = [name for sequence in sequences for name in store.parts(sequence)]
    folder.check(out, [*store.TABLES, store.CONFIG, *parts])
    folder.remove_leftovers(out)
    folder.release_below(out, *store.FROM_ALL, store.FIGURES)
    for sequence in sorted(store.stored_sequences(folder.made(out)) - sequences):
        logger.warning("%s: removed from %s, not among the recordings any more", sequence, out)
        folder.release(out, store.parts(sequence))
    folder.claim(out, parts)


def _collect(
    out: Path, outcomes: list[Outcome], methods: list[str], jobs: int, scheduler: str | None
) -> Tables:
    """Put the sequences' results together, in the order of their ids."""
    folder.remove_leftovers(out)  # of a cluster's worker that died
    done = [outcome for outcome in outcomes if not outcome.problem]
    parts = [_part(out, outcome) for outcome in done]
    folder.claim(out, [store.METRICS, store.SEQUENCES])
    concatenate(parts, out / store.METRICS, SCHEMA)
    write_csv(out / store.SEQUENCES, _sequences_table(outcomes))
    export(out, [outcome.about for outcome in done], methods, jobs, scheduler)
    folder.seal(out, [store.METRICS, store.SEQUENCES, store.CONFIG])
    tables = make_tables(out)
    folder.settle(out)
    return tables


def _part(out: Path, outcome: Outcome) -> Path:
    """One sequence's part of the metrics, if it is still the one that the outcome tells of."""
    path = store.metrics_path(out, outcome.sequence)
    if store.done(out, outcome.sequence, outcome.about["key"]) is None:
        raise VtgtsamError(
            f"{path} was changed while this ran; call again when nothing else uses {out}"
        )
    return path


def _sequences_table(outcomes: list[Outcome]) -> pd.DataFrame:
    rows = [
        {"sequence": outcome.sequence}
        | {name: outcome.about.get(name, "") for name in DESCRIPTION}
        | {"warnings": " | ".join(outcome.about.get("warnings", [])), "problem": outcome.problem}
        for outcome in outcomes
    ]
    return pd.DataFrame(rows)


def _config_yaml(configs: Mapping[str, EstimatorConfig], given: Given) -> str:
    """The effective configuration."""
    effective = {
        "version": code_version(),
        **given.described(),
        "methods": {name: config.model_dump(mode="json") for name, config in configs.items()},
    }
    return yaml.safe_dump(effective, sort_keys=False)
