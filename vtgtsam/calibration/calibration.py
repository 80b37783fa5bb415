# SPDX-License-Identifier: MIT
r"""A robot's calibration: where its camera really is, where its joints are zero, and how sure that is.

    T_wo_visual = C(e) T_wo,    C(e) = Trans(c) Exp(e) Trans(-c)      what the camera reports
    q = q_true + dq                                                   what the joints report

e is a twist in the world's axes about the point c, rotation [rad] first, then translation [m].
"""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gtsam
import numpy as np
import yaml

from ..atomic import write_text
from ..exceptions import CalibrationError
from ..frame import require_pose
from ..input.plain import plain
from ..input.text import parse_yaml, read_yaml
from ..measurement import Measurement
from ..offsets import CalibrationPrior
from .robot import Robot

if TYPE_CHECKING:
    from ..hands.pads import PadSet
    from ..recording import Recording

SYMMETRIC = 1e-6  # largest relative difference of two entries that should be equal


@dataclass(frozen=True, eq=False)
class Calibration:
    """What is known of one robot's offsets.

    Attributes:
        robot: Its hand, joints and camera.
        camera: The camera's twist e, shape (6,).
        camera_origin: The point c that it turns about, in the world [m], shape (3,).
        joint_zeros: dq by joint name [rad], in the order of ``joint_names``.
        covariance: Of the camera's six, then of the joints' zeros, shape (6 + J, 6 + J).
        unseen: Which directions no grasp showed, and which grasps would, in sentences.
        made_from: Digests of the recordings that it knows already.
    """

    robot: Robot
    camera: np.ndarray
    camera_origin: np.ndarray
    joint_zeros: Mapping[str, float]
    covariance: np.ndarray
    unseen: tuple[str, ...] = ()
    made_from: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        size = 6 + len(self.joint_zeros)
        for name, shape in (
            ("camera", (6,)),
            ("camera_origin", (3,)),
            ("covariance", (size, size)),
        ):
            array = np.array(getattr(self, name), dtype=np.float64)
            if array.shape != shape or not np.isfinite(array).all():
                raise ValueError(f"{name} must be finite numbers of shape {shape}, got {array}")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if tuple(self.joint_zeros) != self.robot.joint_names:
            raise ValueError(
                f"joint_zeros must be those of {', '.join(self.robot.joint_names)}, in that order, "
                f"got {', '.join(self.joint_zeros)}"
            )
        if not all(math.isfinite(zero) for zero in self.joint_zeros.values()):
            raise ValueError(f"joint_zeros must be finite, got {dict(self.joint_zeros)}")
        _check_covariance(self.covariance)

    @property
    def hand(self) -> str:
        """The hand's name."""
        return self.robot.hand

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The joints, in the order of the covariance's rows from the seventh on."""
        return self.robot.joint_names

    @property
    def offsets(self) -> np.ndarray:
        """The camera's twist, then the joints' zeros, shape (6 + J,)."""
        return np.concatenate([self.camera, self.zeros])

    @cached_property
    def zeros(self) -> np.ndarray:
        """The joints' zeros [rad], shape (J,)."""
        return np.array(list(self.joint_zeros.values()))

    @cached_property
    def prior(self) -> CalibrationPrior:
        """What it leaves uncertain, about the corrected measurements."""
        return CalibrationPrior(self.covariance, self.camera_origin)

    def check_hand(self, hand: PadSet) -> None:
        """Refuse another hand.

        Raises:
            CalibrationError: It is another one, or has no joints.
        """
        self.robot.check_hand(hand)

    def check(self, recording: Recording) -> None:
        """Refuse a recording of another hand or camera.

        Raises:
            CalibrationError: It is.
        """
        self.robot.check(recording)

    @cached_property
    def camera_motion(self) -> gtsam.Pose3:
        """C(e): by which motion of the world visual poses are off."""
        about = gtsam.Pose3(gtsam.Rot3(), self.camera_origin)
        return about.compose(gtsam.Pose3.Expmap(self.camera)).compose(about.inverse())

    @cached_property
    def _camera_back(self) -> gtsam.Pose3:
        """C(e)^-1."""
        return self.camera_motion.inverse()

    def corrected(self, measurement: Measurement) -> Measurement:
        """The measurement that a robot without these offsets would have made.

        Covariances of visual poses stay as they are: they are of the tracker, and of a right perturbation.

        Raises:
            ValueError: The visual pose is no ``gtsam.Pose3``, or there is another number of joints.
        """
        seen, joints = measurement.T_wo_visual, measurement.joints
        if seen is not None:
            require_pose(seen, "T_wo_visual")
            seen = self._camera_back.compose(seen)
        if isinstance(joints, Mapping):
            joints = {
                name: angle - self.joint_zeros.get(name, 0.0) for name, angle in joints.items()
            }
        elif joints is not None:
            joints = np.asarray(joints, dtype=np.float64)
            if joints.shape != self.zeros.shape:
                raise ValueError(
                    f"joints must be {len(self.zeros)} angles in joint_names' order, got shape {joints.shape}"
                )
            joints = joints - self.zeros
        return dataclasses.replace(measurement, T_wo_visual=seen, joints=joints)

    def to_yaml(self, path: str | os.PathLike[str]) -> None:
        """Write to a YAML file that ``from_yaml`` reads back equal."""
        write_text(Path(path), self.text())

    def text(self) -> str:
        """As a YAML file has it."""
        robot = self.robot.to_dict()
        if "camera_pose" in robot:
            robot["camera_pose"] = _Rows(robot["camera_pose"])
        content = {
            **robot,
            "camera": {
                "rotation_rad": _Row(self.camera[:3].tolist()),
                "translation_m": _Row(self.camera[3:].tolist()),
                "about_m": _Row(self.camera_origin.tolist()),
            },
            "joint_zeros_rad": {name: float(zero) for name, zero in self.joint_zeros.items()},
            "unseen": list(self.unseen),
            "made_from": list(self.made_from),
            "covariance": _Rows(self.covariance.tolist()),
        }
        return yaml.dump(content, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)

    @classmethod
    def from_yaml(cls, path: str | os.PathLike[str]) -> Calibration:
        """Read a calibration from a YAML file.

        Raises:
            CalibrationError: The file cannot be read, or is no calibration.
        """
        return cls._checked(read_yaml(Path(path), CalibrationError, "the calibration "), str(path))

    @classmethod
    def from_text(cls, text: str, name: str = "the calibration") -> Calibration:
        """As ``from_yaml``, from the file's content; ``name`` is for messages."""
        return cls._checked(parse_yaml(text, name, CalibrationError), name)

    @classmethod
    def _checked(cls, content: object, name: str) -> Calibration:
        if not isinstance(content, dict):
            raise CalibrationError(
                f"{name} is no calibration: expected a mapping, got {content!r:.60}"
            )
        try:
            return cls._of(content)
        except KeyError as error:
            raise CalibrationError(f"{name} is no calibration: it lacks {error}") from error
        except (TypeError, ValueError, OverflowError, AttributeError) as error:
            raise CalibrationError(f"{name} is no calibration: {plain(error)}") from error

    @classmethod
    def _of(cls, content: dict[str, Any]) -> Calibration:
        camera = content["camera"]
        return cls(
            robot=Robot.from_dict(content),
            camera=np.array([*camera["rotation_rad"], *camera["translation_m"]]),
            camera_origin=np.array(camera["about_m"]),
            joint_zeros={
                str(name): float(zero) for name, zero in content["joint_zeros_rad"].items()
            },
            covariance=np.array(content["covariance"]),
            unseen=tuple(str(sentence) for sentence in content.get("unseen", ())),
            made_from=tuple(str(digest) for digest in content.get("made_from", ())),
        )


def _check_covariance(covariance: np.ndarray) -> None:
    """Raise a ValueError for what is no covariance."""
    scale = np.abs(covariance).max()
    if not np.allclose(covariance, covariance.T, rtol=SYMMETRIC, atol=SYMMETRIC * scale):
        raise ValueError("the covariance must be symmetric")
    try:
        np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        raise ValueError("the covariance must be positive definite") from None


class _Row(list[float]):
    """Numbers that YAML writes on one line."""


class _Rows(list[list[float]]):
    """A matrix, of which YAML writes a line a row."""


class _Dumper(yaml.SafeDumper):
    """Knows both."""


def _row(dumper: yaml.SafeDumper, row: list[float]) -> yaml.SequenceNode:
    numbers = [dumper.represent_data(x) for x in row]
    return yaml.SequenceNode("tag:yaml.org,2002:seq", numbers, flow_style=True)


def _rows(dumper: yaml.SafeDumper, rows: _Rows) -> yaml.SequenceNode:
    nodes = [_row(dumper, row) for row in rows]
    return yaml.SequenceNode("tag:yaml.org,2002:seq", nodes, flow_style=False)


_Dumper.add_representer(_Row, _row)
_Dumper.add_representer(_Rows, _rows)
