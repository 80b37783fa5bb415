# SPDX-License-Identifier: MIT
"""MuJoCo Menagerie, where the variable VTGTSAM_MENAGERIE says where it is (its models are not ours to ship)."""

import os
from pathlib import Path

import pytest

FOLDER = Path(os.environ.get("VTGTSAM_MENAGERIE") or "/nonexistent")

needs_menagerie = pytest.mark.skipif(
    not FOLDER.is_dir(),
    reason="VTGTSAM_MENAGERIE names no folder with MuJoCo Menagerie: git clone "
    "https://github.com/google-deepmind/mujoco_menagerie",
)
