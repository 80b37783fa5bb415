# SPDX-License-Identifier: MIT
"""Estimates as a LeRobot dataset of format v3.0, written with pyarrow alone."""

from .export import export_lerobot

__all__ = ["export_lerobot"]
