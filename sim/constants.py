# SPDX-License-Identifier: MIT
"""Numbers of the simulation, each with its source. "Paper" is Mack et al., ICRA 2025."""

from __future__ import annotations

import numpy as np

# Physics (paper, "Simulation Experiment Setup": also elliptic cones and implicitfast).
TIME_STEP = 0.001  # [s]
STEPS_PER_SAMPLE = 10  # tactile and joints at 100 Hz
STEPS_PER_FRAME = 33  # images at 1 / 0.033 s, about 30 Hz

# Contact. MuJoCo's defaults, which the paper uses, let pad and object overlap by 1-2 mm. The method
# assumes rigid bodies, so contacts are stiffer here; this is the one departure from the paper.
SOLREF = (0.004, 1.0)  # [s], [-]: 4 time steps; 2 are MuJoCo's least
SOLIMP = (0.99, 0.999, 1e-4, 0.5, 2.0)

# Friction, by how many times stiffer it is than the contact (MuJoCo's impratio). At MuJoCo's default, which the paper
# uses, whatever is held creeps: in the median 0.2 mm a second, a ball 1.2 (``python -m sim contacts``). With 10, as
# MuJoCo Menagerie's grippers have it, it is a quarter of that.
FRICTION = {"paper": 1.0, "dry": 10.0}

# Motors. Proportional gains from the paper ("Grasp Motion Control"); the rest is ours: enough damping
# that no joint rings, armature about that of a 288:1 gear so that light links do not jitter.
GAINS = (1.0, 0.7, 0.3)  # [N m/rad], proximal, middle, distal
DAMPINGS = (0.05, 0.035, 0.015)  # [N m s/rad]
STALL_TORQUE = 0.52  # [N m], XL330-M288-T at 5 V (ROBOTIS e-manual)
ARMATURE = 0.001  # [kg m^2]
JOINT_DAMPING = 0.01  # [N m s/rad]
HOLD_GAIN = 200.0  # [N m/rad], joints that only hold their place (palm, thumb rotation)
HOLD_DAMPING = 2.0  # [N m s/rad]

# The wrist, a stiff servo that turns the hand.
WRIST_GAIN = 5000.0  # [N m/rad]: 1 N m of hand and object bend it by 0.01 degrees
WRIST_DAMPING = 60.0  # [N m s/rad]
WRIST_ARMATURE = 0.2  # [kg m^2], about an arm's, so that closing fingers do not shake it

# The course of a sequence; time 0 is where grasp and tracking begin (paper, "Datasets").
REST = 1.0  # [s], before time 0: the object comes to rest on the palm
TURN_START = 4.5  # [s] (paper: the first 4.5 s are "before the hand rotates")
TURN_END = 10.0  # [s] (paper: occlusion has increased "after about 10 s")
TURN_ANGLE = np.deg2rad(45.0)  # [rad], backward, fingers towards the camera
DURATION = 12.0  # [s]

# Sensors and camera.
FULL_PRESSURE = 6.0  # [N], normal force at which a pad's signal is 1 (paper: calibrated at 6 N)
CAMERA_DISTANCE = 0.6  # [m], horizontal, from the palm (paper)
CAMERA_HEIGHT = 0.576  # [m], above the palm (paper)
CAMERA_FOVY = 42.6  # [deg] (MuJoCo's unit here), 2 atan(240 / 615): the D435's colour image

# Objects of unknown mass. Household objects lie between 200 (foam brick) and 1000 (full can).
DENSITY = 500.0  # [kg/m^3]
MAX_MASS = 0.5  # [kg]

# A grasp is accepted where it holds.
MAX_REST_SPEED = 0.05  # [m/s], of the object when the grasp begins (paper: "mostly static")
MAX_HELD_SPEED = 0.02  # [m/s], of the object when the turn begins
MAX_SLIP = 0.03  # [m], of the object in the hand from before the turn to the end
MIN_PADS = 2  # touched in all
MIN_FINGER_PADS = 1  # touched on fingers and thumb: what only lies on the palm is not grasped
