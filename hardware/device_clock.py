# SPDX-License-Identifier: MIT
"""A device's own clock, told in the host's monotonic time.

A device stamps what it sends with its own clock, which started at some unknown instant and runs a
little fast or slow; the host sees each message late by a delay that is never negative and often
near its least. So the offset between the clocks is the least difference seen of late:

    t_host = t_device + min(t_received - t_device)    over the last messages

The least delay itself stays inside as a constant error, and a clock that is wrong by a fraction e
adds at most e times the window's duration.

A clock may also jump, as when somebody sets it. Ahead, the least difference follows at once. Back, all messages look
late from then on; the offset is found anew. A line that had stalled looks otherwise: what waited comes all at once.
"""

from __future__ import annotations

from collections import deque

WINDOW = 50  # [messages], 1 s at 50 Hz: a resonator wrong by 0.5 % adds 5 ms, a crystal 0.05 ms
JUMP = 0.5  # [s], later than this ...
ALIKE = 5  # ... in so many messages in a row that come as fast as they were sent is a clock that has jumped


class DeviceClock:
    """Turns a device's stamps into host time; results never decrease while its stamps do not.

    Attributes:
        jumps: How often the clock has jumped back.
    """

    def __init__(self, window: int = WINDOW) -> None:
        self.jumps = 0
        self._offsets: deque[float] = deque(maxlen=window)
        self._recent: deque[tuple[float, float]] = deque(maxlen=ALIKE)  # stamps and arrivals [s]

    def to_host(self, device_time: float, received: float) -> float:
        """Host time [s] of a stamp, never later than its arrival.

        Args:
            device_time: The stamp, by the device's clock [s].
            received: When the message arrived, by the host's monotonic clock [s].
        """
        self._offsets.append(received - device_time)
        self._recent.append((device_time, received))
        if len(self._recent) == ALIKE and self._jumped():
            self.jumps += 1
            self._offsets.clear()
            self._offsets.extend(arrival - stamp for stamp, arrival in self._recent)
        return device_time + min(self._offsets)

    def restart(self) -> None:
        """Forget the offset, because the device's clock has started again."""
        self._offsets.clear()
        self._recent.clear()

    def _jumped(self) -> bool:
        """Whether the last messages are all late, though none of them waited for another."""
        late = min(arrival - stamp for stamp, arrival in self._recent) - min(self._offsets) > JUMP
        (first_stamp, first_arrival), (last_stamp, last_arrival) = self._recent[0], self._recent[-1]
        return late and last_arrival - first_arrival > 0.5 * (last_stamp - first_stamp)
