# SPDX-License-Identifier: MIT
"""What a stored result was made from, so that only what is missing or changed is computed again."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..config import EstimatorConfig
from ..objects import ObjectModel
from ..pads import PadSet
from ..recording.topics import ObjectFile, TopicMap


def sequence_key(
    recording: Path, configs: Mapping[str, EstimatorConfig], inputs: str, code: str
) -> str:
    """Hash of all that one sequence's results depend on.

    Args:
        recording: The recording, whose content counts, not its name.
        configs: Each method's configuration.
        inputs: Digest of what was given beside the recording (``inputs_digest``).
        code: Version of the code (``code_version``).
    """
    made_from = {
        "recording": _content(recording),
        "methods": {name: config.model_dump(mode="json") for name, config in configs.items()},
        "inputs": inputs,
        "code": code,
    }
    return hashlib.sha256(json.dumps(made_from).encode()).hexdigest()


def inputs_digest(hand: Any, obj: Any, topics: TopicMap | None) -> str:
    """Hash of a hand, an object and a topic map given beside the recordings."""
    parts = [_of_hand(hand), _of_object(obj)]
    if topics is not None:
        parts += [topics.model_dump_json(), _of_hand(topics.hand), _of_object(topics.object)]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


@cache
def code_version() -> str:
    """The package's version and a hash of its sources: a changed estimator is another estimator."""
    root = Path(__file__).parents[1]
    sources = sorted(path for path in root.rglob("*") if path.suffix in (".py", ".xml"))
    digest = hashlib.sha256()
    for path in sources:
        digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return f"{__version__}+{digest.hexdigest()[:12]}"


def _content(path: Path) -> str:
    """Hash of a file, or of all files in a folder."""
    digest = hashlib.sha256()
    for file in [path] if path.is_file() else sorted(p for p in path.rglob("*") if p.is_file()):
        with file.open("rb") as stream:
            digest.update(hashlib.file_digest(stream, "sha256").digest())
    return digest.hexdigest()


def _of_hand(hand: Any) -> str | None:
    if isinstance(hand, PadSet):
        points = np.ascontiguousarray(hand.points_p)
        return _hash(str(hand.pad_names), getattr(hand, "xml", ""), points, hand.offsets)
    return _of_name(hand)


def _of_object(obj: Any) -> str | None:
    if isinstance(obj, ObjectModel):
        mesh = () if obj.mesh is None else (obj.mesh.vertices, obj.mesh.faces)
        return _hash(obj.name, obj.sdf.values, obj.sdf.lower, obj.sdf.upper, *mesh)
    if isinstance(obj, ObjectFile):
        return f"{obj.model_dump_json()} {_of_name(obj.mesh)}"
    return _of_name(obj)


def _of_name(name: Any) -> str | None:
    """A file's content; anything else is a built-in name, whose meaning is in the code's version."""
    if name is None:
        return None
    return _content(Path(name)) if Path(name).is_file() else str(name)


def _hash(*values: Any) -> str:
    digest = hashlib.sha256()
    for value in values:
        digest.update(value.encode() if isinstance(value, str) else np.asarray(value).tobytes())
    return digest.hexdigest()
