# SPDX-License-Identifier: MIT
"""What a serial port raises once its adapter or board is unplugged."""

from __future__ import annotations

import termios

PORT_ERRORS = (OSError, termios.error)  # pyserial's own is an OSError, termios.error is none
