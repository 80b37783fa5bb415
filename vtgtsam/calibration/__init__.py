# SPDX-License-Identifier: MIT
"""Where a robot's camera really is, and where its joints are zero, from grasps that it made anyway."""
