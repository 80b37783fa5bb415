# SPDX-License-Identifier: MIT
"""Which topics of a bag hold what: the map that makes other people's bags readable.

The YAML file looks like this; every entry but ``joints`` and ``contacts`` is optional, and a topic
that is not mentioned is looked for under this package's own name::

    hand: my_hand.xml            # name or MJCF/URDF path, relative to this file
    pads: "skin_*"               # which of its box sites are pads; "pad_*" where not given; or a YAML
                                 # file of pads, relative to this file
    object: my_mug.obj           # name or mesh path; or {mesh:, scale:, origin:, resolution:, symmetry:}
    topics:
      joints: /robot/joint_states
      contacts: {topic: /skin/values, names: [pad_a, pad_b], threshold: 0.15}   # of the raw value; or
      # {topic: /skin/ohms, names: [...], threshold: 0.15, calibration: {untouched: 2, drop: 900}}
      hand_pose: /robot/wrist                      # or {tf: [world, wrist]}, live only
      vision: {topic: /foundationpose/pose, latency: 0.06, frame: camera}
      camera_pose: [0.6, 0, 0.576, 0, 0, 0, 1]     # x y z qx qy qz qw, or a topic
      truth: /mocap/object
      images: /camera/color/image_raw              # whose stamps numbered pose files count
      depth: {topic: /camera/depth/image, info: /camera/depth/camera_info}   # for our own tracker, live only
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import gtsam
import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    ValidationError,
)

from ..exceptions import RecordingError
from ..input.plain import plain
from ..input.text import read_yaml
from . import names
from .messages import QUATERNION_TOLERANCE


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


def _checked_drop(value: float | tuple[float, ...]) -> float | tuple[float, ...]:
    if not np.all(np.asarray(value)):
        raise ValueError("must not be 0: it is how far a press with 6 N changes the value")
    return value


Drop = Annotated[
    FiniteFloat | Annotated[tuple[FiniteFloat, ...], Field(min_length=1)],
    AfterValidator(_checked_drop),
]


def _text(value: Any) -> Any:
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


Name = Annotated[str, BeforeValidator(_text)]  # YAML makes a number of 0


class PadCalibration(_Model):
    """How raw values of resistive pads become pressures, as the paper calibrates them.

    The pressure is u = max((base - value) / drop, 0), as fraction of a press with 6 N. The baseline
    ``base`` is each pad's median while nothing touched the hand, at the start of the bag.

    Attributes:
        untouched: How long nothing touches the hand after the first message [s].
        drop: How far a press with 6 N lowers the value, in its own unit; one number for all pads or
            one a pad; negative where a press raises it.
    """

    untouched: Annotated[FiniteFloat, Field(gt=0)] = 2.0
    drop: Drop


class ContactsTopic(_Model):
    """Where the contact bits are.

    Attributes:
        topic: A topic of TactilePads, Float32MultiArray, Float64MultiArray, UInt8MultiArray, or JointState
            with pads as names and what they feel as efforts.
        names: The pads' names in the order of an array's values.
        threshold: A value at or above it is a contact. Needed for arrays of floats, in their own
            unit; 1 where not given for UInt8MultiArray; TactilePads carry their own bits unless a
            threshold on their pressure is given here.
        calibration: For arrays of raw values: the threshold is then a fraction of 6 N.
    """

    topic: str = names.CONTACTS
    names: tuple[Name, ...] | None = None
    threshold: FiniteFloat | None = None
    calibration: PadCalibration | None = None


MOST_LATENCY = 1e6  # [s]


class VisionTopic(_Model):
    """Where the visual tracker's poses are.

    Attributes:
        topic: A topic of PoseStamped or PoseWithCovarianceStamped.
        latency: How long after the image a pose is stamped [s]: true time = stamp - latency.
        frame: Whether the poses are given in the world (T_wo) or the camera frame (T_co).
    """

    topic: str = names.VISION
    latency: Annotated[FiniteFloat, Field(ge=-MOST_LATENCY, le=MOST_LATENCY)] = 0.0
    frame: Literal["world", "camera"] = "world"


class ObjectFile(_Model):
    """A mesh file and how it becomes object coordinates: p_o = scale * p_file - origin [m].

    Attributes:
        mesh: The file; or a distance field's .npz, where no metrics are wanted.
        scale: Metres per unit of the file.
        origin: Of the object frame [m].
        resolution: Nodes along each side of the distance field.
        symmetry: What ``load_object`` takes: an axis, an entry of BOP's file, or a file with one.
    """

    mesh: str
    scale: Annotated[FiniteFloat, Field(gt=0)] = 1.0
    origin: tuple[FiniteFloat, FiniteFloat, FiniteFloat] | Literal["center"] | None = None
    resolution: Annotated[int, Field(ge=2)] = 128
    symmetry: dict[str, Any] | str | None = None


class TfPose(_Model):
    """A pose from the transforms on /tf and /tf_static, live only.

    Attributes:
        tf: The frame that the pose is given in and the frame whose pose it is, as in ``[world, wrist]``.
    """

    tf: Annotated[tuple[Name, ...], Field(min_length=2, max_length=2)]


class DepthTopic(_Model):
    """Depth images for our own tracker, live only.

    Attributes:
        topic: Images of 16 bit [mm] or 32 bit float [m], raw or compressed as PNG, all rectified.
        info: The camera's CameraInfo.
        infrared: Images of 8 bit of the stereo camera's left imager, with the depth's stamps and pixels, as a
            RealSense's `infra1/image_rect_raw`; they show "depth-hand" where the object ends.
        tracker: "depth", or "depth-hand": knows the hand.
    """

    topic: str
    info: str
    infrared: str | None = None
    tracker: Literal["depth", "depth-hand"] = "depth-hand"


def _from_topic_name(value: Any) -> Any:
    return {"topic": value} if isinstance(value, str) else value


def _checked_pose(value: tuple[float, ...] | TfPose | str) -> tuple[float, ...] | TfPose | str:
    if isinstance(value, tuple) and abs(np.linalg.norm(value[3:]) - 1) > QUATERNION_TOLERANCE:
        raise ValueError("the quaternion (the last four numbers) must have norm 1")
    return value


Contacts = Annotated[ContactsTopic, BeforeValidator(_from_topic_name)]
Vision = Annotated[VisionTopic, BeforeValidator(_from_topic_name)]
SevenNumbers = Annotated[tuple[FiniteFloat, ...], Field(min_length=7, max_length=7)]
CameraPose = Annotated[SevenNumbers | TfPose | str, AfterValidator(_checked_pose)]


class Topics(_Model):
    """The topics themselves; ``camera_pose`` may be a constant T_wc instead.

    ``images`` are any stamped messages, one an image; only their stamps are read.
    """

    joints: str
    contacts: Contacts
    hand_pose: str | TfPose = names.HAND_POSE
    vision: Vision = VisionTopic()
    camera_pose: CameraPose = names.CAMERA_POSE
    truth: str = names.TRUTH
    estimate: str = names.ESTIMATE
    images: str | None = None
    depth: DepthTopic | None = None

    def used(self) -> Iterator[str]:
        """Names of all topics that are read, images apart."""
        yield from (self.joints, self.contacts.topic, self.hand_topic, self.vision.topic)
        yield from (self.truth, self.estimate, names.CALIBRATION, names.VISION_CORRELATION)
        if isinstance(self.camera_pose, str):
            yield self.camera_pose

    @property
    def hand_topic(self) -> str:
        """The topic of the hand's pose."""
        return "/tf" if isinstance(self.hand_pose, TfPose) else self.hand_pose

    def check_bag(self) -> None:
        """Refuse what no bag has.

        Raises:
            RecordingError: A pose comes from /tf.
        """
        for entry, value in (("hand_pose", self.hand_pose), ("camera_pose", self.camera_pose)):
            if isinstance(value, TfPose):
                raise RecordingError(
                    f"{entry} comes from /tf ({' to '.join(value.tf)}), which is only read live; record with "
                    "`vtgtsam ros --record`, or publish that transform as a PoseStamped or TransformStamped of its own"
                )

    def fixed_camera_pose(self) -> gtsam.Pose3 | None:
        """The constant camera pose T_wc, where the map gives one."""
        if not isinstance(self.camera_pose, tuple):
            return None
        x, y, z, qx, qy, qz, qw = self.camera_pose
        n = float(np.linalg.norm([qx, qy, qz, qw]))
        return gtsam.Pose3(gtsam.Rot3.Quaternion(qw / n, qx / n, qy / n, qz / n), [x, y, z])


class TopicMap(_Model):
    """A bag's topics, and the hand and object in it."""

    hand: str | None = None
    pads: str = "pad_*"
    object: str | ObjectFile | None = None
    topics: Topics = Topics(joints=names.JOINTS, contacts=ContactsTopic())


def load_topics(path: str | Path) -> TopicMap:
    """Read the map from a YAML file; the files it names are relative to it.

    Raises:
        RecordingError: The file cannot be read or says something that is not understood.
    """
    path = Path(path)
    content = read_yaml(path, RecordingError, "the topic map ")
    if not isinstance(content, dict) or "topics" not in content:
        raise RecordingError(
            f"the topic map {path} must have an entry 'topics' with at least joints and contacts"
        )
    try:
        topic_map = TopicMap.model_validate(content)
    except ValidationError as error:
        raise RecordingError(f"the topic map {path}: {_sentence(error)}") from None
    return _with_paths_from(topic_map, path.parent)


def _sentence(error: ValidationError) -> str:
    """The problem that lies deepest, in words; a union's other branches fail further up."""
    problem = max(error.errors(), key=lambda problem: len(problem["loc"]))
    # Names of the union's branches stand in the location too; they mean nothing to a reader.
    place = ".".join(str(part) for part in problem["loc"] if not _is_branch(part)) or "the file"
    if problem["type"] == "extra_forbidden":
        return f"unknown entry '{plain(place)}'; remove it or correct its name"
    if problem["type"] == "missing":
        return f"the entry '{place}' is missing"
    message = problem["msg"].removeprefix("Value error, ")
    return f"'{place}': {message[0].lower()}{message[1:]}, got {plain(repr(problem['input']))}"


def _is_branch(part: int | str) -> bool:
    return isinstance(part, str) and ("[" in part or part in {"str", "ObjectFile", "TfPose"})


def _with_paths_from(topic_map: TopicMap, folder: Path) -> TopicMap:
    """The map with the files that exist below ``folder`` named from here."""

    def found(name: str) -> str:
        return str(folder / name) if (folder / name).is_file() else name

    def found_symmetry(text: str) -> str:
        name, mark, number = text.partition("#")
        return found(name) + mark + number

    hand = topic_map.hand and found(topic_map.hand)
    obj = topic_map.object
    if isinstance(obj, str):
        obj = found(obj)
    elif obj is not None:
        more = {"symmetry": found_symmetry(obj.symmetry)} if isinstance(obj.symmetry, str) else {}
        obj = obj.model_copy(update={"mesh": found(obj.mesh), **more})
    return topic_map.model_copy(update={"hand": hand, "pads": found(topic_map.pads), "object": obj})
