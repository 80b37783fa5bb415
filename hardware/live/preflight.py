# SPDX-License-Identifier: MIT
"""What a run needs to fit together, seen before anything is opened or moves."""

from __future__ import annotations

from pathlib import Path

from hardware.servo.description import HandDescription, misfits
from vtgtsam import HandModel
from vtgtsam.exceptions import ConfigError
from vtgtsam.grasp import GraspDescription, load_grasp


def load_hand_and_grasp(description: HandDescription) -> tuple[HandModel, GraspDescription]:
    """The model of a built hand and how it closes, all of whose joints and pads are there by name.

    Raises:
        ConfigError: The hand's file and its model name different joints or pads; all are listed.
        HandError: Model or grasp cannot be read, or name different joints.
    """
    if not description.grasp and Path(description.hand).is_file():
        raise ConfigError(
            f"the hand's file names the model {description.hand} but not how it closes: say so under `grasp`, "
            "with a file like vtgtsam/grasp/isyhand.yaml"
        )
    grasp = load_grasp(description.grasp or description.hand)
    hand = grasp.load_hand()
    grasp.check(hand)
    if found := misfits(description, hand):
        raise ConfigError(f"the hand's file does not fit hand {hand.name!r}: {'; '.join(found)}")
    without = sorted(set(grasp.ranks()) - set(description.joint_names))
    if without:
        raise ConfigError(f"the grasp closes joints without a servo: {', '.join(without)}")
    return hand, grasp
