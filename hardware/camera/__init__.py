# SPDX-License-Identifier: MIT
"""Cameras and what is calibrated with them."""
