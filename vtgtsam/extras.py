# SPDX-License-Identifier: MIT
"""Packages beyond the core: which extra brings them, and the line that installs it.

The core estimates poses of a ``PadSet``'s hand. What more a part of the package needs it says when it is imported.
"""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

from .exceptions import MissingExtraError

PACKAGES = {  # by extra: the modules that it brings
    "mjcf": ("mujoco",),
    "recordings": ("mujoco", "mcap", "mcap_ros2", "lz4", "zstandard", "rosbags"),
    "evaluate": ("pandas", "pyarrow", "joblib", "threadpoolctl", "matplotlib", "jinja2"),
    "cli": ("typer", "rich"),
    "viz": ("rerun",),
    "cluster": ("distributed", "fsspec"),
}


def require(extra: str, what: str, *modules: str) -> None:
    """Refuse to go on without an extra's packages.

    Args:
        extra: Its name.
        what: What needs it, the sentence's subject and verb: "recordings need".
        modules: Those that are needed; all of the extra's where none is given.

    Raises:
        MissingExtraError: One of them is not installed; says what to type.
    """
    missing = [name for name in modules or PACKAGES[extra] if not _is_there(name)]
    if missing:
        named = " and ".join(filter(None, [", ".join(missing[:-1]), missing[-1]]))
        raise MissingExtraError(f"{what} {named}: {install_line(extra)}")


def explained(error: ModuleNotFoundError, what: str) -> ImportError:
    """The error that says which extra brings a module, or the error as it is where none does."""
    module = (error.name or "").partition(".")[0]
    extras = [extra for extra, modules in PACKAGES.items() if module in modules]
    if isinstance(error, MissingExtraError) or not extras:
        return error
    return MissingExtraError(f"{what} {module}: {install_line(extras[0])}")


def install_line(extra: str) -> str:
    """What to type for an extra: from the checkout that this package is run from, else from the package index."""
    checkout = Path(__file__).parents[1]
    if (checkout / "pyproject.toml").is_file():
        return f"pip install -e '{checkout}[{extra}]'"
    return f"pip install 'vtgtsam[{extra}]'"


def _is_there(module: str) -> bool:
    return sys.modules.get(module) is not None or find_spec(module) is not None
