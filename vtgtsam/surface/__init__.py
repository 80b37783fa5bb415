# SPDX-License-Identifier: MIT
"""Exact distances from many points to a triangle mesh."""

from .surface import Surface as Surface
