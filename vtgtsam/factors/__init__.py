# SPDX-License-Identifier: MIT
"""The factors, one a file: each gives its formula, its Jacobian, and a thin GTSAM factor around them."""
