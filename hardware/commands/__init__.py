# SPDX-License-Identifier: MIT
"""One file for each command of ``python -m hardware``."""
