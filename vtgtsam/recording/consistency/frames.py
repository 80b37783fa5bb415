# SPDX-License-Identifier: MIT
"""Poses that say they are given in different frames, and are all taken as the world's."""

from __future__ import annotations

from collections.abc import Iterator

from .evidence import Evidence
from .finding import Finding


def check_frames(evidence: Evidence) -> Iterator[Finding]:
    """World poses of hand, camera, vision and truth whose headers name different frames."""
    named: dict[str, list[str]] = {}
    camera = evidence.topics.vision.frame == "camera"
    for topic, stream in evidence.poses():
        if not (camera and topic == evidence.topics.vision.topic):
            for frame in filter(None, stream.frames):
                named.setdefault(frame, []).append(topic)
    if len(named) > 1:
        said = ", ".join(f"{' and '.join(topics)} in {frame!r}" for frame, topics in named.items())
        yield Finding(
            "frames differ",
            f"poses say that they are given in different frames ({said}), but all are taken as the world's; "
            "unless these are one frame, transform them before recording (poses of the object in the "
            "camera frame: 'frame: camera' in the topic map)",
            "warning",
        )
