# SPDX-License-Identifier: MIT
"""Which types and qualities are subscribed; a stand-in has the ROS graph."""

from __future__ import annotations

from types import SimpleNamespace as Found

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed here: make test-ros has it")

from rclpy.qos import DurabilityPolicy  # noqa: E402

from vtgtsam.recording.messages import JOINT_STATE, TACTILE_PADS  # noqa: E402
from vtgtsam.ros.health import Link  # noqa: E402
from vtgtsam.ros.intake import Intake  # noqa: E402
from vtgtsam.ros.subscriptions import INPUT, LATCHED, Subscriptions  # noqa: E402

KEPT, VOLATILE = DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE
POSE = "geometry_msgs/msg/PoseStamped"


class Graph:
    """A node and who publishes; subscriptions are (type's name, quality)."""

    def __init__(self):
        self.publishers, self.subscriptions = [], []

    def add(self, kind, durability=VOLATILE):
        self.publishers.append(
            Found(
                topic_type=kind,
                qos_profile=Found(durability=durability),
                node_name="n",
                node_namespace="/",
            )
        )

    def resolve_topic_name(self, topic):
        return topic

    def get_publishers_info_by_topic(self, topic):
        return self.publishers

    def create_subscription(self, kind, topic, callback, quality):
        self.subscriptions.append((kind.__name__, quality))
        return self.subscriptions[-1]

    def destroy_subscription(self, made):
        self.subscriptions.remove(made)

    def get_logger(self):
        return Found(info=lambda text: None)


@pytest.fixture
def graph():
    return Graph()


def followed(graph, types, latched=True):
    link = Link(Intake("/topic", types, print), None)
    subscriptions = Subscriptions(graph, [link], [link] if latched else [])
    subscriptions.look()
    return link, subscriptions


def test_nothing_is_subscribed_before_someone_publishes(graph):
    link, subscriptions = followed(graph, (POSE,))
    assert graph.subscriptions == [] and link.publishers == ()
    graph.add(POSE)
    subscriptions.look()
    subscriptions.look()
    assert graph.subscriptions == [("PoseStamped", INPUT)]
    assert link.publishers == ("/n",)


def test_a_publisher_that_keeps_its_message_gets_a_subscription_of_its_own(graph):
    graph.add(POSE, KEPT)
    _, subscriptions = followed(graph, (POSE,))
    assert graph.subscriptions == [("PoseStamped", LATCHED)]
    graph.add(POSE, VOLATILE)
    subscriptions.look()
    assert graph.subscriptions == [("PoseStamped", LATCHED), ("PoseStamped", INPUT)]


def test_joints_are_never_latched(graph):
    graph.add(JOINT_STATE, KEPT)
    followed(graph, (JOINT_STATE,), latched=False)
    assert graph.subscriptions == [("JointState", INPUT)]


def test_a_publisher_of_another_type_takes_the_place_of_one_that_went(graph):
    graph.add(POSE)
    _, subscriptions = followed(graph, (POSE, "nav_msgs/msg/Odometry"))
    graph.publishers.clear()
    graph.add("nav_msgs/msg/Odometry")
    subscriptions.look()
    assert graph.subscriptions == [("Odometry", INPUT)]


def test_a_type_that_is_not_understood_or_not_installed_is_said(graph):
    graph.add("std_msgs/msg/String")
    link, subscriptions = followed(graph, (JOINT_STATE, TACTILE_PADS))
    assert link.problem.startswith("/topic has type std_msgs/msg/String, expected sensor_msgs")
    graph.publishers.clear()
    graph.add(TACTILE_PADS)
    subscriptions.look()
    assert "std_msgs/msg/UInt8MultiArray or Float32MultiArray with their names" in link.problem
    assert graph.subscriptions == []
