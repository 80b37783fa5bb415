# SPDX-License-Identifier: MIT
"""Real YCB meshes for tests, from the folder VTGTSAM_YCB names; nothing of them is kept here."""

import os
from pathlib import Path

import pytest


def ycb_path(name):
    """The file of one mesh; skips the test where there is none."""
    folder = os.environ.get("VTGTSAM_YCB")
    if not folder:
        pytest.skip("needs YCB meshes: VTGTSAM_YCB names no folder")
    path = Path(folder) / f"{name}.obj"
    if not path.is_file():
        pytest.skip(f"needs YCB meshes: VTGTSAM_YCB has no {name}.obj")
    return path
