# SPDX-License-Identifier: MIT
"""A sequence of one second instead of twelve, for tests that need a sequence but not its content."""

import pytest

from sim import constants


def shorten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(constants, "REST", 0.3)
    monkeypatch.setattr(constants, "TURN_START", 0.3)
    monkeypatch.setattr(constants, "TURN_END", 0.5)
    monkeypatch.setattr(constants, "DURATION", 0.6)
    monkeypatch.setattr(constants, "MIN_PADS", 0)
    monkeypatch.setattr(constants, "MAX_SLIP", 1.0)
    monkeypatch.setattr(constants, "MAX_REST_SPEED", 1.0)
