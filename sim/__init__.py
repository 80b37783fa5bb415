# SPDX-License-Identifier: MIT
"""The simulator: a hand grasps an object in MuJoCo while a camera and tactile pads observe it."""
