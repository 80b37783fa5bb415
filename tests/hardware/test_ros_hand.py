# SPDX-License-Identifier: MIT
"""A hand behind a ROS 2 driver, with the genuine rclpy (make test-ros)."""

from __future__ import annotations

import os
import threading
import time

import pytest

rclpy = pytest.importorskip("rclpy", reason="rclpy is not installed here: make test-ros has it")

from hardware.ros_hand import RosHand, RosHandError, Topics  # noqa: E402

LIMITS = {"a": (-0.3, 2.0), "b": (-0.3, 2.0)}


@pytest.fixture
def driver(monkeypatch):
    """A driver's node: joints that go to their goals under torque; its state."""
    from rclpy.executors import SingleThreadedExecutor
    from sensor_msgs.msg import JointState
    from std_srvs.srv import SetBool

    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setenv("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node("driver", context=context)
    state = {"torque": False, "joints": {"b": 0.0, "a": 0.0}}
    told = node.create_publisher(JointState, "/hand/joints", 10)

    def tell():
        message = JointState(name=[*state["joints"]], position=[*state["joints"].values()])
        message.header.stamp = node.get_clock().now().to_msg()
        told.publish(message)

    def go(message):
        if state["torque"]:
            state["joints"] |= dict(zip(message.name, message.position, strict=True))

    def switch(request, response):
        state["torque"], response.success = request.data, True
        return response

    node.create_timer(0.01, tell)
    node.create_subscription(JointState, "/hand/goals", go, 10)
    node.create_service(SetBool, "/hand/torque", switch)
    executor, stop = SingleThreadedExecutor(context=context), threading.Event()
    executor.add_node(node)

    def spin():
        while not stop.is_set():
            executor.spin_once(timeout_sec=0.05)

    thread = threading.Thread(target=spin)
    thread.start()
    yield state
    stop.set()
    thread.join()
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown(context=context)


def test_a_driver_over_dds_moves_its_joints(driver):
    with RosHand(LIMITS, Topics("/hand/joints", "/hand/goals", "/hand/torque")) as hand:
        hand.configure()
        hand.enable()
        assert driver["torque"]
        hand.command({"a": 0.2})
        end = time.monotonic() + 20
        while hand.state().angles["a"] != 0.2:
            assert time.monotonic() < end
            time.sleep(0.01)
        assert hand.state().angles["b"] == 0.0
    assert not driver["torque"]


def test_a_hand_whose_joints_are_called_otherwise_is_refused(driver):
    with pytest.raises(RosHandError, match="has not told c within 5 s"):
        RosHand({**LIMITS, "c": (0.0, 1.0)}, Topics("/hand/joints", "/hand/goals", "/hand/torque"))
