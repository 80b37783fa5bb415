# SPDX-License-Identifier: MIT
"""A sequence of a third of a second instead of twelve, for tests that need a sequence but not its content."""

import pytest

from sim import constants

SAMPLES, FRAMES = 31, 10


def shorten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(constants, "REST", 0.1)
    monkeypatch.setattr(constants, "TURN_START", 0.1)
    monkeypatch.setattr(constants, "TURN_END", 0.25)
    monkeypatch.setattr(constants, "DURATION", 0.3)
    monkeypatch.setattr(constants, "MIN_PADS", 0)
    monkeypatch.setattr(constants, "MIN_FINGER_PADS", 0)
    monkeypatch.setattr(constants, "MAX_SLIP", 1.0)
    monkeypatch.setattr(constants, "MAX_REST_SPEED", 1.0)
    monkeypatch.setattr(constants, "MAX_HELD_SPEED", 1.0)
