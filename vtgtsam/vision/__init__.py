# SPDX-License-Identifier: MIT
"""Where the visual pose comes from: a tracker for depth images, or files another program wrote."""
