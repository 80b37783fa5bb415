# SPDX-License-Identifier: MIT
"""The hand's pose in the camera frame, from a tag on its wrist (``calibrate-wrist``).

The tag's place on the hand stands in the hand's YAML file:

    wrist_tag:
      id: 0                # in family tag36h11
      size: 0.04           # [m], side of the black square
      T_ht: [-0.04, 0.01, 0.04, 0.7071068, -0.7071068, 0, 0]    # x y z [m] qx qy qz qw, tag frame in h

and the result, T_ch = T_ct T_ht^-1, in a file of its own, as it changes whenever camera or hand is
moved. ``tag`` says what the tag's axes are.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import gtsam
import numpy as np
import yaml
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from vtgtsam.atomic import write_text
from vtgtsam.exceptions import ConfigError
from vtgtsam.input.plain import plain
from vtgtsam.input.text import read_yaml

from .camera import Camera, CameraError
from .tag import IMAGES, TagDetector, TagPose, measure_tag


def _checked_pose(numbers: tuple[float, ...]) -> tuple[float, ...]:
    if abs(np.linalg.norm(numbers[3:]) - 1.0) > 1e-3:
        raise ValueError("the quaternion (the last four numbers) must have norm 1")
    return numbers


_SevenNumbers = Annotated[tuple[FiniteFloat, ...], Field(min_length=7, max_length=7)]
_PoseNumbers = Annotated[_SevenNumbers, AfterValidator(_checked_pose)]


class TagMount(BaseModel):
    """The tag on the hand.

    Attributes:
        id: Its number in the family tag36h11.
        size: Side of its black square, without the white rim [m].
        T_ht: Pose of the tag frame in the hand frame: x y z [m] qx qy qz qw.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    id: int = Field(ge=0, lt=587)
    size: float = Field(gt=0.005, lt=0.5)  # more or less is a number in millimetres or a slip
    T_ht: _PoseNumbers

    @property
    def pose(self) -> gtsam.Pose3:
        """T_ht."""
        return _pose(self.T_ht)


def measure_wrist(camera: Camera, mount: TagMount) -> tuple[gtsam.Pose3, TagPose, np.ndarray]:
    """The hand's pose T_ch from the camera's first 30 images, what it was made from, and what they show in depth [m].

    Args:
        camera: The camera; neither it nor the hand may move meanwhile.
        mount: The tag and its place on the hand.

    Raises:
        CameraError: The camera gives no colour images, or the tag is not seen well enough.
    """
    detector = TagDetector(mount.id, mount.size, camera.intrinsics)
    colors, depths = _images(camera)
    tag = measure_tag(colors, detector)
    return tag.T_ct.compose(mount.pose.inverse()), tag, np.median(depths, axis=0)


def _images(camera: Camera) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Thirty colour and depth images."""
    colors: list[np.ndarray] = []
    depths: list[np.ndarray] = []
    while len(colors) < IMAGES:
        frame = camera.read()
        if frame is None:
            raise CameraError(
                f"{camera.name} ended after {len(colors)} colour images, {IMAGES} are needed"
            )
        if frame.color is not None:
            colors.append(frame.color)
            depths.append(frame.depth)
    return colors, depths


def save_wrist(path: str | Path, T_ch: gtsam.Pose3) -> None:
    """Write the hand's pose in the camera frame as YAML."""
    quaternion = T_ch.rotation().toQuaternion()
    numbers = [*T_ch.translation(), *(getattr(quaternion, axis)() for axis in "xyzw")]
    text = yaml.safe_dump({"T_ch": [round(float(n), 7) for n in numbers]}, default_flow_style=None)
    header = (
        "# Pose of the hand in the camera frame, x y z [m] qx qy qz qw, by\n"
        "# `python -m hardware calibrate-wrist`; measure it again when camera or hand was moved\n"
    )
    write_text(Path(path), header + text)


class _WristFile(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")

    T_ch: _PoseNumbers


def load_wrist(path: str | Path) -> gtsam.Pose3:
    """The hand's pose T_ch in the camera frame.

    Raises:
        ConfigError: The file cannot be read or holds no pose.
    """
    advice = "run `python -m hardware calibrate-wrist`"
    if not Path(path).exists():
        raise ConfigError(f"there is no wrist calibration {path} yet: {advice}")
    try:
        document = read_yaml(Path(path), ConfigError, "the wrist calibration ")
    except ConfigError as error:
        raise ConfigError(f"{error}: {advice}") from error
    try:
        return _pose(_WristFile.model_validate(document).T_ch)
    except ValidationError as error:
        raise ConfigError(
            f"{path} must hold T_ch: [x, y, z, qx, qy, qz, qw] with a quaternion of norm 1, got "
            f"{plain(document)}: {advice}"
        ) from error


def _pose(numbers: tuple[float, ...]) -> gtsam.Pose3:
    qx, qy, qz, qw = np.array(numbers[3:]) / np.linalg.norm(numbers[3:])
    return gtsam.Pose3(gtsam.Rot3.Quaternion(qw, qx, qy, qz), np.array(numbers[:3]))
