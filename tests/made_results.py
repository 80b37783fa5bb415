# SPDX-License-Identifier: MIT
"""Stored results of evaluations that never took place: errors drawn at random, for tables and figures.

A sequence is 3 s long at 8 Hz; its hand turns from 1 s to 2 s, and the errors grow with the turn, for the
first method most.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import yaml

from vtgtsam import EstimatorConfig
from vtgtsam.evaluation import store
from vtgtsam.evaluation.errors import SCHEMA
from vtgtsam.evaluation.estimates import SCHEMA as ESTIMATES
from vtgtsam.evaluation.parquet import concatenate, write_table

METHODS = ("vis", "vis+pen", "vis+tac+pen")
TIMES = 0.125 * np.arange(24)  # [s]
PADS = ("pad_thumb", "pad_index", "pad_palm")

_PHASES = np.where(TIMES < 1, "before", np.where(TIMES < 2, "turning", "after"))
_GROWTH = dict(zip(METHODS, (6.0, 4.0, 2.0), strict=True))


def write_results(
    out: Path,
    datasets: Sequence[str] = ("vary",),
    scales: Sequence[str] = ("1",),
    objects: Sequence[str] = ("can", "box", "mug", "bowl"),
    runs: int = 2,
    estimates: bool = True,
    failed: Sequence[str] = (),
) -> Path:
    """What ``evaluate`` stores before it makes tables: as many sequences as all of these together."""
    rng = np.random.default_rng(0)
    rows, parts = [], []
    for dataset in datasets:
        for scale in scales:
            for name in (f"{thing}_{run}" for thing in objects for run in range(runs)):
                sequence = f"{dataset}__noise_{scale}__{name}"
                about = {"sequence": sequence, "object": name.rsplit("_", 1)[0], "dataset": dataset}
                parts.append(store.metrics_path(out, sequence))
                write_table(parts[-1], _metrics(about, float(scale), rng), {})
                if estimates:
                    write_table(
                        store.estimates_path(out, sequence), _estimates(rng), {"pads": PADS}
                    )
                rows.append(about | {"noise_scale": scale, "frames": str(len(TIMES))})
    rows += [{"sequence": name, "problem": "it is no recording"} for name in failed]
    concatenate(parts, out / store.METRICS, SCHEMA)
    columns = ("note", "warnings", "problem")
    table = pd.DataFrame(rows).reindex(columns=[*rows[0], *columns]).assign(tracker="depth")
    table.to_csv(out / store.SEQUENCES, index=False)
    settings = {
        name: EstimatorConfig.tuned(method=name).model_dump(mode="json") for name in METHODS
    }
    (out / store.CONFIG).write_text(yaml.safe_dump({"version": "1.2.3+abc", "methods": settings}))
    return out


def rewrite_metrics(out: Path, metrics: pd.DataFrame) -> None:
    """Replace ``metrics.parquet``: a row group a sequence, as ``evaluate`` writes it."""
    with pq.ParquetWriter(out / store.METRICS, SCHEMA) as writer:
        for _, of_sequence in metrics.groupby("sequence", sort=False):
            writer.write_table(
                pa.Table.from_pandas(of_sequence, schema=SCHEMA, preserve_index=False)
            )


def _metrics(about: dict[str, str], noise: float, rng: np.random.Generator) -> pa.Table:
    hardness = rng.lognormal(0, 0.3)
    tables = []
    for method in METHODS:
        growth = _GROWTH[method] * np.clip(TIMES - 1, 0, 1)
        adds = 1e-3 * hardness * (noise + growth) * rng.lognormal(0, 0.2, len(TIMES))
        columns = {
            "method": method,
            "time": 1 + TIMES,
            "time_rel": TIMES,
            "adds_m": adds,
            "add_m": 2 * adds,
            "translation_m": 3 * adds,
            "rotation_rad": 4 * adds,
            "nees": adds / adds.mean(),
            "nees_dof": 6,
            "status": "ok",
            "phase": _PHASES,
        }
        tables.append(pd.DataFrame(about | columns))
    return pa.Table.from_pandas(pd.concat(tables), schema=SCHEMA, preserve_index=False)


def _estimates(rng: np.random.Generator) -> pa.Table:
    starts = rng.uniform(0, 1.5, len(PADS))
    rows = [
        {"method": method, "time_rel": time, "contacts": (time > starts).tolist()}
        for method in METHODS
        for time in TIMES.tolist()
    ]
    return pa.Table.from_pylist(rows, schema=ESTIMATES)
