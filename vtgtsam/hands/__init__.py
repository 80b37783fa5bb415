# SPDX-License-Identifier: MIT
"""Robot hands: their pads, their joints, and the files that describe them."""
