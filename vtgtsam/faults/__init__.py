# SPDX-License-Identifier: MIT
"""Which stream contradicts the others: one watch a file, fed frame by frame, that answers in fixed words."""
