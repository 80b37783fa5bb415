# SPDX-License-Identifier: MIT
"""Until the hand is open and at rest, from where everything else begins."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from vtgtsam.exceptions import LiveError

from .fingers import Fingers, Phase

_OPENING = 15.0  # [s], the most that opening the hand may take
_SETTLING = 2.0  # [s], the most that is waited for the open hand to come to rest
_STILL = 0.005  # [rad], what a joint at rest may move in 0.2 s
_GLANCE = 0.1  # [s], how often to look


def wait_until_open(fingers: Fingers, watch: Callable[[], None]) -> None:
    """Return once every joint was tried, and the open hand rests.

    Args:
        fingers: The hand, which is being opened.
        watch: Looks after the run meanwhile; raises where it has to end.

    Raises:
        LiveError: It did not open; names the joints that are not there.
    """
    deadline = time.monotonic() + _OPENING
    while fingers.phase is not Phase.OPEN:
        watch()
        if time.monotonic() > deadline:
            raise LiveError(
                f"the hand did not open within {_OPENING:.0f} s: {fingers.not_there()}; is something in its way?"
            )
        time.sleep(_GLANCE)
    _let_settle(fingers, watch)


def _let_settle(fingers: Fingers, watch: Callable[[], None]) -> None:
    """Wait until it has come to rest, but not for ever: friction lets some creep."""
    deadline, before = time.monotonic() + _SETTLING, fingers.joints
    while time.monotonic() < deadline:
        time.sleep(2 * _GLANCE)
        watch()
        now = fingers.joints
        if before is not None and now is not None and np.abs(now - before).max() < _STILL:
            return
        before = now
