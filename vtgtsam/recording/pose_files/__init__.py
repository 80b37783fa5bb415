# SPDX-License-Identifier: MIT
"""Visual poses that another program estimated, read from the files it wrote."""

from .files import PoseFiles as PoseFiles
