# SPDX-License-Identifier: MIT
"""What a caller gives beside the recordings: another hand, another object, a topic map, a calibration."""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from ..calibration.calibration import Calibration
from ..hands.model import load_hand
from ..hands.pad_file import is_pad_file
from ..hands.pads import PadSet
from ..mesh import symmetry
from ..objects import ObjectModel
from ..recording import Recording, TopicMap, load_topics, read_recording
from ..recording.topics import ObjectFile


@dataclass(frozen=True)
class Given:
    """Overrides for all recordings of a run, None where there are none.

    Attributes:
        hand: A hand in memory, or its name or absolute path.
        obj: An object in memory, or its name or absolute path.
        topics: The topic map.
        calibration: Where the robot's camera and its joints' zeros are.
    """

    hand: PadSet | str | None
    obj: ObjectModel | str | None
    topics: TopicMap | None
    calibration: Calibration | None = None

    @classmethod
    def of(
        cls,
        hand: PadSet | str | os.PathLike[str] | None,
        obj: ObjectModel | str | os.PathLike[str] | None,
        topics: TopicMap | str | os.PathLike[str] | None,
        calibration: Calibration | str | os.PathLike[str] | None = None,
    ) -> Given:
        """Take what a caller gave.

        Raises:
            RecordingError: The topic map cannot be read.
            CalibrationError: The calibration cannot be read.
        """
        if isinstance(calibration, str | os.PathLike):
            calibration = Calibration.from_yaml(calibration)
        if isinstance(topics, str | os.PathLike):
            topics = load_topics(Path(topics).resolve())
        return cls(_absolute(hand), _absolute(obj), topics, calibration)

    def read(self, path: Path) -> Recording:
        """Read a recording with these overrides.

        Raises:
            RecordingError: It cannot be read.
            CalibrationError: The calibration is of another robot.
        """
        recording = read_recording(path, hand=self.hand, object=self.obj, topics=self.topics)
        if self.calibration is not None:
            self.calibration.check(recording)
        return recording

    def digest(self) -> str:
        """Hash of all of it, files by their content."""
        parts = [_of_hand(self.hand), _of_object(self.obj)]
        if self.topics is not None:
            topics = self.topics
            parts += [topics.model_dump_json(), _of_hand(topics.hand), _of_object(topics.object)]
            parts.append(_of_name(topics.pads))
        if self.calibration is not None:
            parts.append(self.calibration.text())
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()

    def described(self) -> dict[str, Any]:
        """As the effective configuration tells it."""
        return {
            "hand": _name(self.hand),
            "object": _name(self.obj),
            "topics": None if self.topics is None else self.topics.model_dump(mode="json"),
            "calibration": None
            if self.calibration is None
            else yaml.safe_load(self.calibration.text()),
        }


def _absolute(model: Any) -> Any:
    """A path that is right wherever a worker runs; names and models as they are."""
    if isinstance(model, str | os.PathLike):
        return str(Path(model).resolve()) if Path(model).is_file() else str(model)
    return model


def _name(model: Any) -> str | None:
    if model is None or isinstance(model, str):
        return model
    return str(getattr(model, "name", model))


def _of_hand(hand: PadSet | str | None) -> str | None:
    if isinstance(hand, PadSet):
        return _hash(str(hand.pad_names), getattr(hand, "xml", ""), hand.points_p, hand.offsets)
    if hand is not None and is_pad_file(hand):  # two files
        return _of_hand(load_hand(hand))
    return _of_name(hand)


def _of_object(obj: ObjectModel | ObjectFile | str | None) -> str | None:
    if isinstance(obj, ObjectModel):
        mesh = () if obj.mesh is None else (obj.mesh.vertices, obj.mesh.faces)
        return _hash(
            obj.name, json.dumps(obj.symmetry), obj.sdf.values, obj.sdf.lower, obj.sdf.upper, *mesh
        )
    if isinstance(obj, ObjectFile):
        file = obj.symmetry.partition("#")[0] if isinstance(obj.symmetry, str) else None
        return f"{obj.model_dump_json()} {_of_mesh(obj.mesh)} {_of_name(file)}"
    return _of_mesh(obj)


def _of_mesh(name: str | None) -> str | None:
    """A mesh file's content with that of the symmetries beside it."""
    if name is None or not Path(name).is_file():
        return name
    return f"{_of_name(name)} {_of_name(str(Path(name).parent / symmetry.FILE))}"


def _of_name(name: str | None) -> str | None:
    """A file's content; anything else is a built-in name, whose meaning is in the code's version."""
    if name is None or not Path(name).is_file():
        return name
    return hashlib.sha256(Path(name).read_bytes()).hexdigest()


def _hash(*values: Any) -> str:
    digest = hashlib.sha256()
    for value in values:
        digest.update(value.encode() if isinstance(value, str) else np.asarray(value).tobytes())
    return digest.hexdigest()
