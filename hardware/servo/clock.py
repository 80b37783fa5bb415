# SPDX-License-Identifier: MIT
"""Whether a servo made its answer after it was asked, by its own clock.

When a USB hub stalls, the answers to one cycle's question may arrive in the next cycle, and look
like its answers. From then on each position would be a cycle too old, unnoticed. But every servo
counts milliseconds (Realtime Tick, 0..32767, then from 0 again). An answer cannot arrive before it
was made, so

    t_ours - t_servo <= t_arrival - tick

and the least right side so far, grown by how much the clocks may have drifted apart since, bounds
the offset between them from above. With it, the tick of an answer tells the latest time at which it
can have been made. Where that is before the question, the answer is an old one.

The same comparison shows a servo that has restarted by itself, as after a dip of its supply; it then
holds no torque and has lost its gains and its current cap.
"""

from __future__ import annotations

from enum import Enum

_TURN = 32.768  # [s], after which the tick begins anew
_SLACK = 0.002  # [s], rounding of ticks
_DRIFT = 0.03  # of the time since; with an oscillator farther off, no byte would get through
_LONGEST_LAG = 1.0  # [s], no answer lies on the way for longer
_FORGET = 10.0  # [s], after which the drift says nothing any more


class Freshness(Enum):
    """What the servo's clock says about an answer."""

    FRESH = "fresh"
    STALE = "made before it was asked for"
    RESTARTED = "made after a restart"


class ServoClock:
    """One servo's clock, compared with ours from answer to answer."""

    def __init__(self) -> None:
        self._offset: float | None = None  # [s], ours minus the servo's, at most
        self._since = 0.0  # [s], when that was so

    def forget(self) -> None:
        """Start anew, as after a reboot we asked for."""
        self._offset = None

    def check(self, tick: int, asked: float, arrived: float) -> Freshness:
        """Judge an answer, and learn from it unless it is an old one.

        Args:
            tick: The servo's Realtime Tick in its answer [ms].
            asked: Our time when the question went out [s].
            arrived: Our time when the answer came [s].
        """
        offset = arrived - tick / 1000
        if self._offset is None or arrived - self._since > _FORGET:
            self._offset, self._since = offset, arrived
            return Freshness.FRESH
        most = self._offset + _DRIFT * (arrived - self._since)
        on_the_way = (offset - most + _TURN / 2) % _TURN - _TURN / 2  # [s], at least
        if abs(on_the_way) > _LONGEST_LAG:
            return Freshness.RESTARTED
        if arrived - on_the_way < asked - _SLACK:
            return Freshness.STALE
        self._offset, self._since = most + min(on_the_way, 0.0), arrived
        return Freshness.FRESH
