# SPDX-License-Identifier: MIT
"""What a sound recording holds: metadata, hand, mesh and numbers of a stranger."""

from __future__ import annotations

from pathlib import Path

import gtsam
import numpy as np
from held_box import HAND_XML, PADS, box_obj

from vtgtsam.recording import RecordingWriter

from .kind import Kind, command, library
from .recording import content


def _contents(folder: Path) -> list[bytes]:
    metadata = b"hand=clamp\nobject=box\nobject_scale=1.0\nobject_origin=0 0 0\nobject_symmetry={}\ndataset=vary\n"
    return [metadata, HAND_XML.encode(), box_obj(), b"0 0.5 1.0 1.05 1.1 -0.2 0 1 nan 3"]


def _use_contents(path: Path, folder: Path, rng: np.random.Generator) -> str:
    """A sound file whose contents are a stranger's."""
    data, whole = path.read_bytes(), _contents(folder)
    place = {"metadata.txt": 0, "hand.xml": 1, "object.obj": 2, "numbers.txt": 3}[path.name]
    whole[place] = data
    pairs = (line.partition("=") for line in whole[0].decode(errors="replace").split("\n"))
    info = {key: value for key, _, value in pairs}
    values = [float(w) if _is_float(w) else 0.0 for w in whole[3].decode(errors="replace").split()]
    target = folder / "made.mcap"
    hand = whole[1].decode(errors="replace").encode("utf-8", errors="replace").decode()
    with RecordingWriter(target, info, hand_xml=hand, mesh=whole[2]) as writer:
        for k, value in enumerate(values[:100]):
            t = 1.0 + 0.033 * k if rng.random() < 0.8 else value
            try:
                writer.joint_states(t, [f"j_{name}" for name in PADS], np.full(4, value))
                writer.tactile(t, PADS, np.full(4, value), np.ones(4))
                writer.hand_pose(t, gtsam.Pose3())
                writer.object_pose(t, gtsam.Pose3(gtsam.Rot3(), np.full(3, value)))
            except ValueError:
                continue  # what the writer refuses
    out = folder / "out"
    return library(lambda: content(target)) or (
        command("inspect", target)
        if rng.random() < 0.7
        else command("evaluate", target, "--out", out, "--methods", "vis")
    )


def _is_float(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


CONTENTS = Kind(("metadata.txt", "hand.xml", "object.obj", "numbers.txt"), _contents, _use_contents)
