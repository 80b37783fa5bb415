# SPDX-License-Identifier: MIT
"""How a hand closes round an object: as data, and as a controller for simulated and real hands."""

from .controller import GraspController as GraspController
from .description import GraspDescription as GraspDescription
from .description import load_grasp as load_grasp
