# SPDX-License-Identifier: MIT
"""The terms of a frame's cost, one a file, each with its formula and compiled; and the GTSAM factors that hold them."""
