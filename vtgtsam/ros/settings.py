# SPDX-License-Identifier: MIT
"""What a node is told: by options of the command line, by ROS parameters, which count more."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..exceptions import ConfigError

if TYPE_CHECKING:
    from rclpy.node import Node

    from ..calibration.calibration import Calibration
    from ..config import EstimatorConfig
    from ..hands.model import HandModel
    from ..objects import ObjectModel
    from ..recording.topics import TopicMap


@dataclass(frozen=True)
class Given:
    """The parameters, each with its default.

    Attributes:
        topics: The topic map's file; "" for this package's own names.
        hand: Hand instead of the map's.
        object: Object instead of the map's.
        calibration: The robot's calibration file, or "".
        calibrate: Whether to find out more about the robot meanwhile.
        calibration_out: File to write that to at the end, or ""; where one is given, ``calibrate`` holds.
        force: Whether that file may be there, and is replaced.
        config: The estimator's settings: a preset's name or a file.
        record: File to record to, or "".
        rate: Frames a second, beside those that a visual pose brings forward [Hz].
        world_frame: Name of the world frame in what is published.
        object_frame: Name of the object's frame in /tf; "": the object's name.
        publish_tf: Whether the object's transform is published, where tf2_msgs is there.
        publish_markers: Whether markers are.
    """

    topics: str = ""
    hand: str = ""
    object: str = ""
    calibration: str = ""
    calibrate: bool = False
    calibration_out: str = ""
    force: bool = False
    config: str = "tuned"
    record: str = ""
    rate: float = 30.0
    world_frame: str = "world"
    object_frame: str = ""
    publish_tf: bool = True
    publish_markers: bool = True

    def declared_on(self, node: Node) -> Given:
        """The values after the node's parameters of these names have been declared and asked."""
        from rcl_interfaces.msg import ParameterDescriptor

        fixed = ParameterDescriptor(read_only=True)
        found: dict[str, Any] = {
            entry.name: node.declare_parameter(entry.name, getattr(self, entry.name), fixed).value
            for entry in fields(self)
        }
        return Given(**found)


@dataclass(frozen=True, eq=False)
class Loaded:
    """What the parameters name, read.

    Attributes:
        map: The topic map.
        hand: The hand.
        obj: The object.
        config: The estimator's settings.
        calibration: The robot's calibration, or None.
    """

    map: TopicMap
    hand: HandModel
    obj: ObjectModel
    config: EstimatorConfig
    calibration: Calibration | None


def load(given: Given) -> Loaded:
    """Read everything that the parameters name.

    Raises:
        VtgtsamError: Something is missing or cannot be read, in one sentence.
    """
    from ..calibration.calibration import Calibration
    from ..evaluation.methods import load_config
    from ..recording.reader import hand_of_map, object_of_map
    from ..recording.topics import TopicMap, load_topics

    topic_map = load_topics(given.topics) if given.topics else TopicMap()
    for what in ("hand", "object"):
        if not getattr(given, what) and not getattr(topic_map, what):
            raise ConfigError(
                f"which {what}? Say it with --{what}, in the topic map (--topics), or as parameter {what!r}"
            )
    out = given.calibration_out
    if out and Path(out).exists() and not given.force:
        raise ConfigError(f"{out} is there already; give another name, or --force to replace it")
    calibration = Calibration.from_yaml(Path(given.calibration)) if given.calibration else None
    return Loaded(
        map=topic_map,
        hand=hand_of_map(given.hand or None, topic_map),
        obj=object_of_map(given.object or None, topic_map),
        config=load_config(given.config),
        calibration=calibration,
    )
