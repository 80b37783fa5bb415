# SPDX-License-Identifier: MIT
"""What can go wrong on the servo bus. Every message names the servo or the port."""

from __future__ import annotations

from vtgtsam.exceptions import VtgtsamError


class BusError(VtgtsamError):
    """The port cannot be opened, is gone, or servos do not answer."""


class NoAnswerError(BusError):
    """A servo did not answer, or only with damaged packets."""


class TorqueError(BusError):
    """Torque may still be on: only the power switch helps."""


class ServoError(VtgtsamError):
    """A servo refused what it was told or is in trouble; no torque is on."""


class CommandError(ServoError):
    """A commanded position breaks a rule; nothing was sent, torque stays as it was."""
