# SPDX-License-Identifier: MIT
"""What a grasp that is still going on says of the robot, as a question and its answer: both can be sent."""

from __future__ import annotations

from typing import NamedTuple

import gtsam
import numpy as np

from ..config import EstimatorConfig
from .agreement import odd, used_of, useless
from .graph import pose_key
from .keyframes import Grasp
from .solve import Belief, solve


class Question(NamedTuple):
    """A grasp, and what is known apart from it.

    Attributes:
        number: Which grasp it is.
        grasp: What has been seen of it.
        known: What was known of the offsets before it.
        start: Where the solver starts with them, shape (6 + J,).
        camera_origin: The point that the camera's twist turns about, in the world [m], shape (3,).
        config: As the estimator's that tracked it.
    """

    number: int
    grasp: Grasp
    known: Belief
    start: np.ndarray
    camera_origin: np.ndarray
    config: EstimatorConfig


class Answer(NamedTuple):
    """What a grasp says.

    Attributes:
        number: Which grasp.
        refused: Why it says nothing; empty where it does.
        belief: What is known of the offsets with it.
        poses: The object's pose in the hand in its keyframes, by their instants.
    """

    number: int
    refused: str
    belief: Belief
    poses: dict[float, gtsam.Pose3]


def answer_to(question: Question) -> Answer:
    """Solve a grasp, and judge it as recorded ones are judged."""
    grasp, known, origin = question.grasp, question.known, question.camera_origin
    reason = useless(grasp)
    if reason:
        return Answer(question.number, reason, known, {})
    solved = solve([grasp], known, question.start, origin, question.config)
    reason = odd(used_of(grasp, 0, solved, origin))
    if reason:
        return Answer(question.number, reason, known, {})
    poses = {
        frame.time: solved.values.atPose3(pose_key(0, index))
        for index, frame in enumerate(grasp.keyframes)
    }
    return Answer(question.number, "", solved.belief, poses)
