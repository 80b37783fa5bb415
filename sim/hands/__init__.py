# SPDX-License-Identifier: MIT
"""Hands that are there to be simulated only, besides those that ``vtgtsam.grasp`` knows."""

from __future__ import annotations

from pathlib import Path

from vtgtsam.grasp import GraspDescription, load_grasp


def load_description(name_or_path: str | Path = "isyhand") -> GraspDescription:
    """How a hand grasps: one of this folder or of ``vtgtsam.grasp`` by its name, or a YAML file.

    Raises:
        HandError: There is no such description, or it is wrong.
    """
    return load_grasp(name_or_path, Path(__file__).parent)
