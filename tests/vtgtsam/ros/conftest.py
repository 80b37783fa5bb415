# SPDX-License-Identifier: MIT
"""A recorded grasp, the node in a process of its own, and someone who listens."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys

import pytest
import yaml
from node_bench import HERE, ROOT, Listener, Process


@pytest.fixture(scope="session")
def ros_domain():
    """A domain of this run's own, on this computer alone."""
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ["ROS_LOCALHOST_ONLY"] = "1"  # the same for Humble
    os.environ["ROS_DOMAIN_ID"] = str(1 + os.getpid() % 100)


@pytest.fixture(scope="session")
def grasp(tmp_path_factory):
    """A grasp of a can, simulated: seven seconds with a turn of the hand."""
    out = tmp_path_factory.mktemp("grasp")
    command = [sys.executable, "-m", "sim", "generate", "--dataset", "vary", "--objects", "can"]
    subprocess.run(
        [*command, "--grasps", "1", "--seed", "77", "--out", str(out)],
        check=True, cwd=ROOT, capture_output=True, timeout=600,
    )  # fmt: skip
    (path,) = out.rglob("*.mcap")
    return path


@pytest.fixture(scope="session")
def topics(tmp_path_factory, grasp, ros_domain):
    """The other robot's topic map."""
    from other_robot import topic_map

    from vtgtsam import load_hand

    path = tmp_path_factory.mktemp("map") / "map.yaml"
    content = {"hand": "isyhand", "object": "can", **topic_map(load_hand("isyhand").pad_names)}
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


@pytest.fixture
def start(ros_domain):
    """Starts programs, which end with the test."""
    with contextlib.ExitStack() as stack:

        def begin(*command):
            process = Process(*command)
            stack.callback(process.end, signal.SIGKILL)
            return process

        yield begin


@pytest.fixture
def start_node(start, topics):
    """Starts the node and waits until it is there."""

    def begin(*arguments):
        node = start("-m", "vtgtsam.cli", "ros", "--topics", topics, *arguments)
        node.wait_for("poses on /vtgtsam/object_pose")
        return node

    return begin


@pytest.fixture
def start_robot(start, grasp):
    """Starts the other robot."""

    def begin(*arguments):
        return start(HERE / "other_robot.py", grasp, *arguments)

    return begin


@pytest.fixture
def listener(ros_domain):
    found = Listener()
    yield found
    found.close()
