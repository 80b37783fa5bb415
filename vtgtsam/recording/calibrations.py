# SPDX-License-Identifier: MIT
"""The calibrations that a live run corrected its measurements with: one from the start, and each change.

A recording holds what was measured, uncorrected, so that it can be evaluated with any calibration or none. Where the
run itself is replayed, these are the ones. The first is attached; a change is a text on /estimate/calibration, the file
of a calibration with the instant of the first frame that it corrected in front.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..calibration.calibration import Calibration
from ..exceptions import CalibrationError, RecordingError
from . import messages, names
from .source import BagMessage

FROM = "in_force_from_s"


class Calibrations(NamedTuple):
    """A run's calibrations.

    Attributes:
        first: The one from the start; None: there was none.
        changes: Each later one with the instant [s] of the first frame that it corrected, in their order.
    """

    first: Calibration | None = None
    changes: tuple[tuple[float, Calibration], ...] = ()


def text_of_change(time: float, calibration: Calibration) -> str:
    """What is written where a calibration is in force from the frame of an instant [s] on."""
    return f"{FROM}: {time!r}\n{calibration.text()}"


def read_calibrations(attachments: Mapping[str, bytes], bag: Sequence[BagMessage]) -> Calibrations:
    """The calibrations in a recording.

    Args:
        attachments: Its attachments by name.
        bag: The messages on /estimate/calibration, in the order of the file.

    Raises:
        RecordingError: One of them cannot be read.
    """
    attached = attachments.get(names.CALIBRATION_ATTACHMENT)
    try:
        first = None if attached is None else _calibration(attached.decode("utf-8"))
        changes = tuple(_change(message) for message in bag)
    except (UnicodeDecodeError, ValueError) as error:
        raise RecordingError(f"a calibration in the recording cannot be read: {error}") from error
    except CalibrationError as error:
        raise RecordingError(f"{error}") from error
    return Calibrations(first, changes)


def _change(message: BagMessage) -> tuple[float, Calibration]:
    if message.msgtype != messages.STRING:
        raise ValueError(
            f"topic {message.topic} has type {message.msgtype}, expected {messages.STRING}"
        )
    text = str(message.decode(message.data).data)
    line, _, rest = text.partition("\n")
    key, _, value = line.partition(": ")
    if key != FROM:
        raise ValueError(f"expected a first line '{FROM}: <seconds>', got {line!r:.60}")
    return float(value), _calibration(rest)


def _calibration(text: str) -> Calibration:
    return Calibration.from_text(text, "a calibration in the recording")
