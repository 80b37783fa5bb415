# SPDX-License-Identifier: MIT
"""Signed distance fields: the grid and its gradient, building one from a mesh, closest points on pads."""
