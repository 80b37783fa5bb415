# SPDX-License-Identifier: MIT
"""Parquet tables that carry a short description of themselves."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from ..atomic import replacing
from ..exceptions import VtgtsamError

_ABOUT = b"vtgtsam"


class DamagedError(VtgtsamError):
    """A stored table cannot be read, or is not what was written."""


def write_table(path: Path, table: pa.Table, about: dict[str, Any]) -> None:
    """Write one table as one row group, with ``about`` (JSON values) in the file's metadata."""
    text = json.dumps(about, sort_keys=True)
    with replacing(path) as temporary:
        pq.write_table(
            table.replace_schema_metadata({_ABOUT: text.encode()}),
            temporary,
            row_group_size=max(len(table), 1),
        )


def read_table(path: Path, columns: list[str] | None = None) -> tuple[pa.Table, dict[str, Any]]:
    """A table, or some columns of it, and its description; the description is empty where it carries none.

    Raises:
        FileNotFoundError: There is no such file.
        DamagedError: It cannot be read.
    """
    try:
        table = pq.read_table(path, columns=columns)
        return table, dict(json.loads((table.schema.metadata or {}).get(_ABOUT, b"{}")))
    except FileNotFoundError:
        raise
    except (OSError, pa.ArrowException, ValueError, KeyError, TypeError, RecursionError) as error:
        raise damaged(path, error) from None


def read_about(path: Path) -> dict[str, Any] | None:
    """The description a table carries, unverified, or None where there is no such file or it cannot be read."""
    try:
        metadata = pq.read_schema(path).metadata or {}
        return dict(json.loads(metadata[_ABOUT]))
    except (OSError, pa.ArrowException, KeyError, TypeError, ValueError, RecursionError):
        return None


def column_names(path: Path) -> frozenset[str]:
    """Names of a table's columns; none where there is no such file or it cannot be read."""
    try:
        return frozenset(pq.read_schema(path).names)
    except (OSError, pa.ArrowException, ValueError):  # names need not be text
        return frozenset()


def read_groups(path: Path) -> Iterator[pa.Table]:
    """A file's row groups, one at a time in memory.

    Raises:
        DamagedError: It cannot be read.
    """
    try:
        with pq.ParquetFile(path) as file:
            for group in range(file.num_row_groups):
                yield file.read_row_group(group)
    except (OSError, pa.ArrowException, ValueError, KeyError) as error:
        raise damaged(path, error) from None


def concatenate(parts: list[Path], path: Path, schema: pa.Schema) -> None:
    """Join tables into one file, a row group a part; one part at a time is in memory.

    Raises:
        DamagedError: A part cannot be read.
    """
    with replacing(path) as temporary, pq.ParquetWriter(temporary, schema) as writer:
        for part in parts:
            table = read_table(part)[0].replace_schema_metadata(None)
            if table.schema != schema:
                raise DamagedError(f"{part} has other columns than {', '.join(schema.names)}")
            if len(table):
                writer.write_table(table, row_group_size=len(table))


def damaged(path: Path, problem: object) -> DamagedError:
    """The error that names a damaged file."""
    words = " ".join(str(problem).split())
    return DamagedError(f"{path} is damaged ({words}); `vtgtsam evaluate` makes it again")
