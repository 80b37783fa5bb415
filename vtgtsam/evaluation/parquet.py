# SPDX-License-Identifier: MIT
"""Parquet tables that carry a short description of themselves."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from ..atomic import replacing

_ABOUT = b"vtgtsam"


def write_table(path: Path, table: pa.Table, about: dict[str, Any]) -> None:
    """Write one table as one row group, with ``about`` (JSON values) in the file's metadata."""
    text = json.dumps(about, sort_keys=True)
    with replacing(path) as temporary:
        pq.write_table(
            table.replace_schema_metadata({_ABOUT: text.encode()}),
            temporary,
            row_group_size=max(len(table), 1),
        )


def read_about(path: Path) -> dict[str, Any] | None:
    """The description a table carries, or None where there is no such file or it cannot be read."""
    try:
        metadata = pq.read_schema(path).metadata or {}
        return dict(json.loads(metadata[_ABOUT]))
    except (OSError, pa.ArrowInvalid, KeyError, ValueError):
        return None


def concatenate(parts: list[Path], path: Path, schema: pa.Schema) -> None:
    """Join tables into one file, a row group a part; one part at a time is in memory."""
    with replacing(path) as temporary, pq.ParquetWriter(temporary, schema) as writer:
        for part in parts:
            table = pq.read_table(part, schema=schema).replace_schema_metadata(None)
            if len(table):
                writer.write_table(table, row_group_size=len(table))
