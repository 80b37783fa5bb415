# SPDX-License-Identifier: MIT
"""The node in a process of its own, and someone who listens to it."""

from __future__ import annotations

import bisect
import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

from vtgtsam.recording import messages

ROOT = Path(__file__).parents[3]
HERE = Path(__file__).parent
PATIENCE = 120.0  # [s], for a busy computer


class Process:
    """A program, whose lines are kept."""

    def __init__(self, *command):
        self.lines = []
        self._process = subprocess.Popen(
            [sys.executable, *map(str, command)],
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"},
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self._process.stdout:
            self.lines.append(line.rstrip())

    @property
    def text(self):
        return "\n".join(self.lines)

    def wait_for(self, words):
        wait_until(lambda: words in self.text or self._process.poll() is not None)
        assert words in self.text, self.text

    def end(self, number=signal.SIGINT):
        """Send a signal and wait; the exit code."""
        if self._process.poll() is None:
            self._process.send_signal(number)
        code = self._process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        return code

    def wait(self):
        code = self._process.wait(PATIENCE)
        self._reader.join(PATIENCE)
        return code


def wait_until(condition, seconds=PATIENCE):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it took too long"
        time.sleep(0.02)


class Listener:
    """A third program's ears: what the node publishes, in this process."""

    def __init__(self):
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray
        from geometry_msgs.msg import PoseWithCovarianceStamped
        from rclpy.executors import SingleThreadedExecutor
        from visualization_msgs.msg import MarkerArray

        rclpy.init()
        self.node = rclpy.create_node("listener")
        self.poses, self.diagnostics, self.markers = [], [], []
        make = self.node.create_subscription
        make(PoseWithCovarianceStamped, "/vtgtsam/object_pose", self._hear, 50)
        self._heard = []  # when each pose came [ns]
        make(DiagnosticArray, "/diagnostics", self.diagnostics.append, 50)
        make(MarkerArray, "/vtgtsam/markers", self.markers.append, 50)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.node)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _hear(self, pose):
        self._heard.append(time.time_ns())
        self.poses.append(pose)

    def latencies(self, sent):
        """From the publishing of the message that completed each pose's instant to the pose, heard here [s].

        Args:
            sent: What the robot published: part, stamp [ns], instant of publishing [ns]. Its contacts have no stamps
                of their own and get those of their receipt.
        """
        streams = {}
        for part, stamp, published in sent:
            stamps, instants = streams.setdefault(part, ([], []))
            stamps.append(published if part == "contacts" else stamp)
            instants.append(published)
        del streams["vision"]  # is never waited for
        found = []
        for heard, pose in zip(self._heard, self.poses, strict=True):
            instant = messages.stamp_ns(pose)
            published = []
            for part, (stamps, instants) in streams.items():
                k = bisect.bisect_left(stamps, instant) - (part == "contacts")
                published.append(instants[min(max(k, 0), len(instants) - 1)])
            found.append((heard - max(published)) / 1e9)
        return found

    def _spin(self):
        from rclpy.executors import ExternalShutdownException

        with contextlib.suppress(ExternalShutdownException):
            while not self._stop.is_set():
                self._executor.spin_once(timeout_sec=0.05)

    def said(self, part):
        """The last diagnostics of a part: level, message, values."""
        for message in reversed(self.diagnostics):
            for status in message.status:
                if status.name == f"vtgtsam: {part}":
                    return status.level[0], status.message, {v.key: v.value for v in status.values}
        return 0, "", {}

    def call(self, name):
        """Call a Trigger service of the node."""
        from std_srvs.srv import Trigger

        client = self.node.create_client(Trigger, f"/vtgtsam/{name}")
        assert client.wait_for_service(PATIENCE)
        future = client.call_async(Trigger.Request())
        wait_until(future.done)
        return future.result()

    def close(self):
        import rclpy

        self._stop.set()
        self._thread.join()
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.try_shutdown()
