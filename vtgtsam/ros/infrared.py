# SPDX-License-Identifier: MIT
"""A stereo camera's left infrared images, kept until the depth image of the same instant is looked at."""

from __future__ import annotations

import threading
from collections import deque
from typing import Any

import numpy as np

from .intake import Intake, Stamps, Unusable

IMAGE = "sensor_msgs/msg/Image"
KEPT = 4  # images: one is looked at late by no more
LATE = 0.02  # [s], an infrared image comes at most so much after the depth measured from it
_ENCODINGS = ("mono8", "8UC1")


def infrared_of(message: Any) -> np.ndarray:
    """The infrared image of a message, uint8, shape (H, W).

    Raises:
        Unusable: It is of another kind, or not whole.
    """
    if message.encoding not in _ENCODINGS:
        raise Unusable(f"has encoding {message.encoding!r}, expected {' or '.join(_ENCODINGS)}")
    data = bytes(message.data)
    if len(data) != message.height * message.step or not 0 < message.width <= message.step:
        raise Unusable(f"has {len(data)} bytes for {message.width} x {message.height} pixels")
    return np.frombuffer(data, np.uint8).reshape(message.height, message.step)[:, : message.width]


class InfraredImages:
    """The last few images of one topic.

    Args:
        topic: Its name.
        stamps: The instants of its messages.

    Attributes:
        intake: What takes the images.
    """

    def __init__(self, topic: str, stamps: Stamps) -> None:
        self._stamps = stamps
        self._come = threading.Condition()
        self._kept: deque[tuple[int, Any]] = deque(maxlen=KEPT)
        self.intake = Intake(topic, (IMAGE,), self._take)

    def _take(self, message: Any) -> None:
        with self._come:
            self._kept.append((self._stamps.of(message), message))
            self._come.notify()

    def at(self, stamp_ns: int) -> np.ndarray | None:
        """The image of that instant, waited for a little; None where there is none that can be used."""
        with self._come:
            self._come.wait_for(lambda: any(s == stamp_ns for s, _ in self._kept), LATE)
            found = [message for stamp, message in self._kept if stamp == stamp_ns]
        try:
            if not found:
                raise Unusable("has no image with the stamp of the last depth image")
            return infrared_of(found[-1])
        except Unusable as error:
            self.intake.unusable += 1
            self.intake.why = str(error)
            return None
