# SPDX-License-Identifier: MIT
"""Bytes of other people's bags, read through a topic map: ROS 1, and rosbag2 in SQLite and MCAP."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from foreign_bags import MAP, write_ros1, write_ros2
from rosbags.rosbag2 import StoragePlugin
from sequences import HAND_XML

from vtgtsam import read_recording

from .kind import Kind, command, library


def _bags(folder: Path) -> list[bytes]:
    (folder / "hand.xml").write_text(HAND_XML)
    (folder / "ball.obj").write_bytes(
        trimesh.creation.icosphere(2, 0.03).export(file_type="obj").encode()
    )
    (folder / "map.yaml").write_text(MAP.replace("object: ball", "object: ball.obj"))
    sqlite = write_ros2(folder / "sqlite", StoragePlugin.SQLITE3)
    mcap = write_ros2(folder / "mcap", StoragePlugin.MCAP)
    about = (sqlite / "metadata.yaml").read_bytes()
    return [
        write_ros1(folder / "ros1").read_bytes(),
        (sqlite / "sqlite.db3").read_bytes(),
        (mcap / "mcap.mcap").read_bytes(),
        about,
    ]


def _use_bag(path: Path, folder: Path, rng: np.random.Generator) -> str:
    bag = path
    if path.suffix in (".db3", ".yaml"):  # one of a folder's two files
        bag = folder / "sqlite"
        (bag / ("sqlite.db3" if path.suffix == ".db3" else "metadata.yaml")).write_bytes(
            path.read_bytes()
        )
    topics = folder / "map.yaml"

    def read() -> None:
        read_recording(bag, topics=topics).measurements()

    problem = library(read)
    if problem or rng.random() < 0.7:
        return problem or command("inspect", bag, "--topics", topics)
    return command("convert", bag, "--topics", topics, "--out", folder / "converted.mcap")


BAG = Kind(("robot.bag", "robot.db3", "robot.mcap", "metadata.yaml"), _bags, _use_bag)
