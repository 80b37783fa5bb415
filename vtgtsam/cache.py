# SPDX-License-Identifier: MIT
"""Results that take seconds to compute (distance fields, convex parts), kept on disk between runs.

Every entry is one ``.npz`` file named by a hash of all that it was computed from, so that it never
goes stale. A file appears under its name only when it is complete: processes may share the folder.
"""

from __future__ import annotations

import hashlib
import io
import logging
import math
import os
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from zipfile import ZipFile

import numpy as np

from . import limits
from .input.plain import plain

logger = logging.getLogger(__name__)

DIGEST = "sha256 of the arrays"  # what else the file holds: a damaged array may look like one
_HEADERS = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}
_ARRAY_BYTES = 4 * limits.NODES  # a field's values are float32


def cache_directory() -> Path:
    """The folder VTGTSAM_CACHE names, else ``vtgtsam`` in the platform's folder for caches."""
    if chosen := os.environ.get("VTGTSAM_CACHE"):
        return Path(chosen).expanduser()
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData/Local") / "vtgtsam"
    if sys.platform == "darwin":
        return Path.home() / "Library/Caches/vtgtsam"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "vtgtsam"


def cached_arrays(
    kind: str, key: str, compute: Callable[[], Mapping[str, np.ndarray]]
) -> dict[str, np.ndarray]:
    """The arrays that ``compute`` returns, from disk where they were computed before.

    A missing or damaged file is computed again; a folder that cannot be written costs a log line
    and the time to compute.

    Args:
        kind: Name of the subfolder, such as "sdf".
        key: Hash of everything the arrays depend on, with a version of the code that computes them.
        compute: Called without arguments where there is nothing on disk.
    """
    try:
        path = cache_directory() / kind / f"{key}.npz"
    except RuntimeError as error:  # Path.home() finds no home directory
        logger.warning("nothing is cached (%s); set VTGTSAM_CACHE to a folder", error)
        return dict(compute())
    found = _read(path)
    if found is None:
        found = dict(compute())
        _write(path, found)
    return found


def _read(path: Path) -> dict[str, np.ndarray] | None:
    try:
        found = read_arrays(path)
        if str(found.pop(DIGEST)) != _digest(found):
            raise ValueError("its digest is another")
    except (FileNotFoundError, NotADirectoryError):
        return None
    except Exception as error:  # NumPy, zipfile and zlib raise a dozen kinds
        logger.warning("%s is damaged (%s) and is made anew", path, plain(error))
        return None
    return found


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """The arrays of an ``.npz`` file, none larger than the file itself explains.

    Raises:
        Exception: Of a dozen kinds, where the file is damaged.
    """
    found = {}
    with ZipFile(path) as archive:
        for entry in archive.infolist():
            limits.check(entry.file_size, _ARRAY_BYTES, f"bytes of {entry.filename} in {path}")
            content = io.BytesIO(archive.read(entry))
            shape, _, kind = _HEADERS[np.lib.format.read_magic(content)](content)
            if math.prod(shape) * kind.itemsize > entry.file_size:
                raise ValueError(f"{entry.filename} says it has shape {shape}")
            content.seek(0)
            array = np.lib.format.read_array(content, allow_pickle=False)
            found[entry.filename.removesuffix(".npy")] = array
    return found


def _digest(arrays: Mapping[str, np.ndarray]) -> str:
    digest = hashlib.sha256()
    for name, array in sorted(arrays.items()):
        digest.update(f"{name} {array.dtype.str} {array.shape} ".encode() + array.tobytes())
    return digest.hexdigest()


def _write(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=".part")
        try:
            with os.fdopen(handle, "wb") as file:
                np.savez(file, **arrays, **{DIGEST: np.array(_digest(arrays))})  # type: ignore[arg-type]
            os.replace(temporary, path)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise
    except OSError as error:
        logger.warning(
            "%s cannot be written (%s); set VTGTSAM_CACHE to a folder that can", path, error
        )
