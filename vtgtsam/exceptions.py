# SPDX-License-Identifier: MIT
"""Errors that a caller may want to catch.

A wrong argument is a ``ValueError`` as everywhere in Python; the classes here are for what comes from
outside the program (files, meshes, hand descriptions) or from a factor's own callback.
"""

from .faults.words import JOINTS_NOT_FINITE


class VtgtsamError(Exception):
    """Base of all errors this package raises for its callers to catch."""


class MeshError(VtgtsamError):
    """A mesh cannot be read, has no volume, or is in the wrong unit."""


class HandError(VtgtsamError):
    """A hand's description cannot be read, or has no pads, or lacks a joint."""


class RecordingError(VtgtsamError):
    """A recording cannot be read or lacks a stream that is needed."""


class ConfigError(VtgtsamError):
    """A configuration file cannot be read or has a wrong value."""


class CalibrationError(VtgtsamError):
    """A calibration cannot be read, or is of another robot, or recordings cannot give one."""


class LiveError(VtgtsamError):
    """A live run cannot go on."""


class MissingExtraError(VtgtsamError, ModuleNotFoundError):
    """A part of this package needs packages that are not installed."""


class FactorError(VtgtsamError):
    """A factor's callback broke the contract that GTSAM does not check itself."""


class NotFiniteError(ValueError):
    """An angle or a pose is NaN or infinite: a matter of one frame, where other wrong arguments are the program's.

    Attributes:
        fault: What is not finite, in the words of ``Estimate.faults``.
    """

    def __init__(self, message: str, fault: str = JOINTS_NOT_FINITE) -> None:
        super().__init__(message)
        self.fault = fault
