# SPDX-License-Identifier: MIT
"""The terms of a frame's cost, one a file: formula, residual and Jacobian side by side, then the GTSAM factor."""
