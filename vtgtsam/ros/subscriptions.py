# SPDX-License-Identifier: MIT
"""Subscriptions that follow the publishers: of the type that a topic has, once it has one.

A map says which topic holds what, not of which type. So a topic is subscribed when a publisher is there, by its type,
and again when one of another type has taken its place.
"""

from __future__ import annotations

import importlib
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from ..recording.messages import TACTILE_PADS
from .health import Link

DEPTH = 50  # messages that wait for a busy executor
INPUT = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=DEPTH,
    reliability=ReliabilityPolicy.BEST_EFFORT,  # matches reliable publishers as well
    durability=DurabilityPolicy.VOLATILE,
)
LATCHED = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=DEPTH,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,  # what was sent once, before we were there
)


class Subscriptions:
    """Keeps the topics of some links subscribed.

    Args:
        node: The node.
        links: The topics.
        latched: Those of them that may be sent once for all: where a publisher keeps what it sent for those who come
            later, they are subscribed so that they get it, beside the usual subscription for others.
    """

    def __init__(self, node: Node, links: list[Link], latched: list[Link]) -> None:
        self._node, self._links, self._latched = node, links, latched
        self._made: dict[
            tuple[int, bool], Any
        ] = {}  # by link, and whether it gets what was sent before

    def look(self) -> None:
        """See who publishes what now, and subscribe to it."""
        for link in self._links:
            topic = self._node.resolve_topic_name(link.intake.topic)
            found = self._node.get_publishers_info_by_topic(topic)
            link.publishers = tuple(
                sorted(f"{p.node_namespace.rstrip('/')}/{p.node_name}" for p in found)
            )
            types = {p.topic_type for p in found}
            if link.type not in types and types:
                self._choose(link, sorted(types))
            if link.type in types:
                for p in found:
                    kept = p.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
                    self._subscribe(link, kept and link in self._latched)

    def _choose(self, link: Link, types: list[str]) -> None:
        """The type of a topic, of those that its publishers have."""
        wanted = [name for name in types if name in link.intake.types]
        if not wanted:
            link.problem = f"{link.intake.topic} has type {', '.join(types)}, expected {' or '.join(link.intake.types)}"
            return
        if _message_class(wanted[0]) is None:
            link.problem = _missing(link.intake.topic, wanted[0])
            return
        for kept in (False, True):
            if (old := self._made.pop((id(link), kept), None)) is not None:
                self._node.destroy_subscription(old)
        link.type, link.problem = wanted[0], ""
        self._node.get_logger().info(f"{link.intake.topic}: {link.type}")

    def _subscribe(self, link: Link, kept: bool) -> None:
        if (id(link), kept) not in self._made:
            self._made[id(link), kept] = self._node.create_subscription(
                _message_class(link.type),
                link.intake.topic,
                link.intake,
                LATCHED if kept else INPUT,
            )


def _message_class(name: str) -> Any:
    """The Python class of a type like sensor_msgs/msg/JointState; None where its package is not there."""
    package, _, message = name.split("/")
    try:
        return getattr(importlib.import_module(f"{package}.msg"), message)
    except (ImportError, AttributeError):
        return None


def _missing(topic: str, name: str) -> str:
    package = name.split("/")[0]
    if name == TACTILE_PADS:
        return (
            f"{topic} has type {name}, whose package is not built here: build it (docs: Live on your robot), or send "
            "the contacts as std_msgs/msg/UInt8MultiArray or Float32MultiArray with their names in the map"
        )
    return f"{topic} has type {name}, and the Python package {package} is not installed here"
