# SPDX-License-Identifier: MIT
"""Tactile pads: from the board's bytes to one contact bit a pad."""
