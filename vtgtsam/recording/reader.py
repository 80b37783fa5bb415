# SPDX-License-Identifier: MIT
"""Read a recording: our own MCAP files and, through a topic map, other people's bags."""

from __future__ import annotations

import dataclasses
import os
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..exceptions import RecordingError
from ..input.door import reading
from . import names
from .align import Streams, to_world
from .bags import open_source
from .calibrations import read_calibrations
from .camera_share import holds_camera, of_tracker
from .consistency.repeats import without_identity, without_repeats
from .named import read_contacts, read_joints
from .poses import PoseStream, read_poses, with_correlations
from .provenance import find_hand, find_object
from .recording import Recording
from .source import BagMessage, Source
from .topics import ObjectFile, TopicMap, Topics, load_topics

if TYPE_CHECKING:
    from ..hands.model import HandModel
    from ..hands.pads import PadSet
    from ..objects import ObjectModel


def read_recording(
    path: str | Path,
    hand: PadSet | str | Path | None = None,
    object: ObjectModel | str | Path | None = None,
    topics: TopicMap | str | Path | None = None,
) -> Recording:
    """Read an MCAP file, a rosbag2 folder or a ROS 1 bag.

    Headers' stamps count, in whatever order the messages come. Hand and object are taken from the
    arguments, else from the topic map, else from the recording itself.

    Args:
        path: The recording.
        hand: The hand, or its name, or the path of its MJCF or URDF file. It needs joints, for a
            recording has no pad poses: a bare PadSet will not do.
        object: The object, or its name, or the path of its mesh.
        topics: Which topics hold what, or the path of such a map; None for our own names.

    Raises:
        RecordingError: The recording or the map cannot be read or used, in one sentence.
    """
    if not isinstance(path, str | os.PathLike):
        raise RecordingError(f"a recording is given by its path, got {type(path).__name__}")
    topic_map = _topic_map(topics)
    topic_map.topics.check_bag()
    source = open_source(path)
    bag = _collect(source, topic_map.topics)
    if not source.topics:
        raise RecordingError(" ".join([f"{path} holds no messages.", *source.warnings]))
    warnings = list(source.warnings)
    with reading(f"what {path} holds", RecordingError):  # a type may be defined as anything
        streams = _streams(bag, topic_map.topics, warnings)
    info = source.metadata.get(names.METADATA, {})
    if streams.vision is not None and holds_camera(info):
        streams.vision = of_tracker(streams.vision)
    recording = Recording(
        path=Path(path),
        info=info,
        topics=topic_map.topics,
        streams=streams,
        make_hand=partial(_hand, hand, topic_map, info, source.attachments),
        make_object=partial(_object, object, topic_map, info, source.attachments),
        present=source.topics,
        make_calibrations=partial(read_calibrations, source.attachments, bag[names.CALIBRATION]),
    )
    recording.warn(warnings)
    return recording


def _topic_map(topics: TopicMap | str | Path | None) -> TopicMap:
    if topics is None:
        return TopicMap()
    if not isinstance(topics, TopicMap | str | os.PathLike):
        raise RecordingError(
            f"topics must be a TopicMap or the path of a YAML file with one, got {type(topics).__name__}"
        )
    return topics if isinstance(topics, TopicMap) else load_topics(topics)


def _collect(source: Source, topics: Topics) -> dict[str, list[BagMessage]]:
    bag: dict[str, list[BagMessage]] = {topic: [] for topic in topics.used()}
    for message in source.messages(bag.keys()):
        bag[message.topic].append(message)
    return bag


def _streams(bag: dict[str, list[BagMessage]], topics: Topics, warnings: list[str]) -> Streams:
    def poses(topic: str) -> PoseStream | None:
        return read_poses(topic, bag[topic], warnings)

    T_wc = topics.fixed_camera_pose()
    if T_wc is None:
        camera = poses(str(topics.camera_pose))
    else:
        camera = PoseStream(np.zeros(1, dtype=np.int64), [T_wc], [None])
    streams = Streams(
        joints=read_joints(topics.joints, bag[topics.joints], warnings),
        contacts=read_contacts(topics.contacts, bag[topics.contacts.topic], warnings),
        hand_pose=poses(topics.hand_topic),
        vision=_vision(_seen(bag, topics, warnings), camera, topics, warnings),
        truth=without_identity(poses(topics.truth), topics.truth, warnings),
        estimate=poses(topics.estimate),
        camera_pose=camera,
    )
    streams.vision_sent = streams.vision
    return without_repeats(streams, topics, warnings)


def _seen(
    bag: dict[str, list[BagMessage]], topics: Topics, warnings: list[str]
) -> PoseStream | None:
    """Visual poses as the tracker sent them."""
    topic = topics.vision.topic
    stream = read_poses(topic, bag[topic], warnings)
    if stream is None:
        return None
    said = names.VISION_CORRELATION
    return with_correlations(stream, said, bag[said], warnings)


def _vision(
    stream: PoseStream | None, camera: PoseStream | None, topics: Topics, warnings: list[str]
) -> PoseStream | None:
    """Visual poses at the instants of their images, in the world frame."""
    stream = without_identity(stream, topics.vision.topic, warnings)
    if stream is None:
        return None
    latency_ns = round(topics.vision.latency * 1e9)
    stream = dataclasses.replace(stream, times_ns=stream.times_ns - latency_ns)
    if topics.vision.frame == "world":
        frame = stream.frames[0]
        if any(word in frame for word in ("camera", "optical")):
            warnings.append(
                f"topic {topics.vision.topic} says its poses are in the frame {frame!r}, but "
                "they are taken as world poses; if they are not, say 'frame: camera' in the topic map"
            )
        return stream
    if camera is None:
        raise RecordingError(
            f"the poses on {topics.vision.topic} are in the camera frame, but the camera's pose is "
            "not known; give camera_pose in the topic map, a topic or seven numbers"
        )
    return to_world(stream, camera, warnings)


def hand_of_map(hand: PadSet | str | Path | None, topic_map: TopicMap) -> HandModel:
    """The hand as given, else as the map names it."""
    return _hand(hand, topic_map, {}, {})


def object_of_map(obj: ObjectModel | str | Path | None, topic_map: TopicMap) -> ObjectModel:
    """The object as given, else as the map names it."""
    return _object(obj, topic_map, {}, {})


def _hand(
    hand: PadSet | str | Path | None,
    topic_map: TopicMap,
    info: dict[str, str],
    attachments: dict[str, bytes],
) -> HandModel:
    from ..hands.model import HandModel, load_hand
    from ..hands.pad_file import is_pad_file

    if hand is None:
        hand = topic_map.hand
    if hand is None:
        return find_hand(info, attachments)
    if isinstance(hand, HandModel):
        return hand
    if not isinstance(hand, str | Path):
        raise RecordingError(
            f"{hand!r} has no joints, and a recording has no pad poses; give a HandModel, or the "
            "name or file of one"
        )
    if Path(hand).is_file() and not is_pad_file(hand):
        return HandModel.from_mjcf(hand, pads=topic_map.pads)
    return load_hand(hand)


def _object(
    obj: ObjectModel | str | Path | None,
    topic_map: TopicMap,
    info: dict[str, str],
    attachments: dict[str, bytes],
) -> ObjectModel:
    from ..objects import load_object

    if obj is None:
        obj = topic_map.object if not isinstance(topic_map.object, ObjectFile) else None
        if isinstance(topic_map.object, ObjectFile):
            entry = topic_map.object
            return load_object(entry.mesh, **entry.model_dump(exclude={"mesh"}))
    if obj is None:
        return find_object(info, attachments)
    return load_object(obj) if isinstance(obj, str | Path) else obj
