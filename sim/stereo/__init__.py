# SPDX-License-Identifier: MIT
"""A simulated stereo camera: what a RealSense D435 does, instead of a formula for its noise.

    infrared.py   two infrared images of the scene, ray cast, lit by a projector's dots (pattern.py, surface.py)
    matching.py   disparity of the two by OpenCV's semi-global matcher, refined below a pixel
    rig.py        where the imagers and the projector are, and their numbers
    aligned.py    the depth image as the colour camera beside them would see it
    video.py      the depth images of one sequence

Correlated errors, fattened edges, shadows beside silhouettes and gaps come out of the matching; none is put in.
"""

from __future__ import annotations

import importlib.util

from vtgtsam.exceptions import VtgtsamError


def check_opencv() -> None:
    """Do nothing where OpenCV is installed.

    Raises:
        VtgtsamError: It is not.
    """
    if importlib.util.find_spec("cv2") is None:
        raise VtgtsamError(
            "the stereo camera matches its images with OpenCV, which is not installed: "
            'pip install "vtgtsam[sim]", or opencv-python-headless alone'
        )
