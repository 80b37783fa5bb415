# SPDX-License-Identifier: MIT
"""The files of a LeRobot dataset of format v3.0, without videos.

    meta/info.json                              columns, rate, counts
    meta/stats.json                             of each column of numbers
    meta/tasks.parquet                          what was done, in words
    meta/episodes/chunk-000/file-000.parquet    where each episode's frames are
    data/chunk-000/file-000.parquet             the frames, a row group an episode

An episode at a time is in memory.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from .statistics import Statistics

VERSION = "v3.0"
FILE_MB = 100  # LeRobot's own: a file is full beyond
FILES_IN_CHUNK = 1000
_FILE = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"

_OWN = {"timestamp": "float32"} | dict.fromkeys(
    ("frame_index", "episode_index", "index", "task_index"), "int64"
)


class DatasetWriter:
    """Writes a dataset episode by episode; ``finish`` makes it whole."""

    def __init__(self, root: Path, fps: int, features: Mapping[str, Mapping[str, Any]]) -> None:
        self.root = root
        self.fps = fps
        self.features = {
            **features,
            **{name: {"dtype": d, "shape": [1], "names": None} for name, d in _OWN.items()},
        }
        self._schema = pa.schema([(name, _type(f)) for name, f in self.features.items()])
        self._tasks: dict[str, int] = {}
        self._episodes: list[dict[str, Any]] = []
        self._stats: dict[str, Statistics] = {}
        self._frames = 0
        self._file = 0
        self._writer: pq.ParquetWriter | None = None

    def add(self, columns: Mapping[str, Any], task: str, sequence: str) -> None:
        """Write one episode.

        Args:
            columns: Values of the features by name, N frames each.
            task: What is done in it, in words.
            sequence: Where it comes from.
        """
        count = len(next(iter(columns.values())))
        frame = np.arange(count)
        number = self._tasks.setdefault(task, len(self._tasks))
        columns = {
            **columns,
            "timestamp": (frame / self.fps).astype(np.float32),
            "frame_index": frame,
            "episode_index": np.full(count, len(self._episodes)),
            "index": self._frames + frame,
            "task_index": np.full(count, number),
        }
        file = self._write(columns)
        stats = {
            name: Statistics.of(columns[name])
            for name, feature in self.features.items()
            if feature["dtype"] != "string"
        }
        for name, of_episode in stats.items():
            self._stats[name] = self._stats[name] + of_episode if self._frames else of_episode
        self._episodes.append(
            {
                "episode_index": len(self._episodes),
                "tasks": [task],
                "length": count,
                "sequence": sequence,
                "data/chunk_index": file // FILES_IN_CHUNK,
                "data/file_index": file % FILES_IN_CHUNK,
                "dataset_from_index": self._frames,
                "dataset_to_index": self._frames + count,
                "meta/episodes/chunk_index": 0,
                "meta/episodes/file_index": 0,
                **{
                    f"stats/{name}/{key}": value
                    for name, of_episode in stats.items()
                    for key, value in of_episode.as_lerobot().items()
                },
            }
        )
        self._frames += count

    def finish(self) -> None:
        """Write what is known only in the end."""
        self._close()
        _write(self.root / "meta/episodes" / _place(0), pa.Table.from_pylist(self._episodes))
        _write(self.root / "meta/tasks.parquet", _tasks_table(list(self._tasks)))
        _write_json(self.root / "meta/info.json", self._info())
        stats = {name: of_all.as_lerobot() for name, of_all in self._stats.items()}
        _write_json(self.root / "meta/stats.json", stats)

    def _info(self) -> dict[str, Any]:
        return {
            "codebase_version": VERSION,
            "robot_type": None,
            "fps": self.fps,
            "total_episodes": len(self._episodes),
            "total_frames": self._frames,
            "total_tasks": len(self._tasks),
            "chunks_size": FILES_IN_CHUNK,
            "data_files_size_in_mb": FILE_MB,
            "video_files_size_in_mb": 200,
            "splits": {"train": f"0:{len(self._episodes)}"},
            "data_path": f"data/{_FILE}",
            "video_path": None,
            "features": self.features,
        }

    def _write(self, columns: Mapping[str, Any]) -> int:
        """Append an episode's frames and return the number of the file that has them."""
        arrays = [_array(columns[field.name], field.type) for field in self._schema]
        path = self.root / "data" / _place(self._file)
        if self._writer is None:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._writer = pq.ParquetWriter(path, self._schema, compression="snappy")
        table = pa.Table.from_arrays(arrays, schema=self._schema)
        self._writer.write_table(table, row_group_size=len(table))
        file = self._file
        if path.stat().st_size > FILE_MB * 2**20:
            self._close()
            self._file += 1
        return file

    def _close(self) -> None:
        if self._writer is not None:
            self._writer.close()
            self._writer = None


def _type(feature: Mapping[str, Any]) -> pa.DataType:
    kind = {"float32": pa.float32(), "int64": pa.int64(), "string": pa.string()}[feature["dtype"]]
    (length,) = feature["shape"]
    return kind if length == 1 else pa.list_(kind, length)


def _array(values: Any, kind: pa.DataType) -> pa.Array:
    if not pa.types.is_fixed_size_list(kind):
        return pa.array(np.ravel(values).tolist(), type=kind)
    flat = pa.array(np.ravel(values), type=kind.value_type)
    return pa.FixedSizeListArray.from_arrays(flat, kind.list_size)


def _tasks_table(tasks: list[str]) -> pa.Table:
    """Their numbers, with the words as what pandas takes for the index."""
    table = pa.table({"task_index": pa.array(range(len(tasks)), pa.int64()), "task": tasks})
    about = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [
            _described("task_index", "int64", "int64"),
            _described("task", "unicode", "object"),
        ],
        "pandas_version": "2.2.0",
    }
    return table.replace_schema_metadata({"pandas": json.dumps(about)})


def _described(name: str, kind: str, dtype: str) -> dict[str, Any]:
    return {
        "name": name,
        "field_name": name,
        "pandas_type": kind,
        "numpy_type": dtype,
        "metadata": None,
    }


def _place(file: int) -> str:
    return _FILE.format(chunk_index=file // FILES_IN_CHUNK, file_index=file % FILES_IN_CHUNK)


def _write(path: Path, table: pa.Table) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(table, path)


def _write_json(path: Path, value: Any) -> None:
    text = json.dumps(value, indent=4, allow_nan=False)
    path.write_text(text + "\n", encoding="utf-8", newline="\n")
