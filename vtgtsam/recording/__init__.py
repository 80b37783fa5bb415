# SPDX-License-Identifier: MIT
"""Recorded sequences: MCAP files with ROS 2 messages, and other people's bags read like them."""

from ..extras import require

require("recordings", "recordings need", "mujoco", "mcap", "mcap_ros2", "lz4", "zstandard")

from .reader import read_recording as read_recording
from .recording import Recording as Recording
from .topics import TopicMap as TopicMap
from .topics import load_topics as load_topics
from .writer import RecordingWriter as RecordingWriter
