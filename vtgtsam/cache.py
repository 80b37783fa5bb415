# SPDX-License-Identifier: MIT
"""Results that take seconds to compute (distance fields, convex parts), kept on disk between runs.

Every entry is one ``.npz`` file named by a hash of all that it was computed from, so that it never
goes stale. A file appears under its name only when it is complete: processes may share the folder.
"""

from __future__ import annotations

import logging
import os
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

logger = logging.getLogger(__name__)

NAMES = "names of the arrays"  # what else the file must hold: a damaged archive may lose some


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
        with np.load(path, allow_pickle=False) as archive:
            found = {name: archive[name] for name in archive.files}
        if found.pop(NAMES).tolist() != sorted(found):
            raise ValueError("an array is missing")
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError, EOFError, KeyError, NotImplementedError, BadZipFile) as error:
        logger.warning("%s is damaged (%s) and is made anew", path, error)
        return None
    return found


def _write(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=".part")
        try:
            with os.fdopen(handle, "wb") as file:
                np.savez(file, **arrays, **{NAMES: np.array(sorted(arrays), dtype=str)})  # type: ignore[arg-type]
            os.replace(temporary, path)
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise
    except OSError as error:
        logger.warning(
            "%s cannot be written (%s); set VTGTSAM_CACHE to a folder that can", path, error
        )
