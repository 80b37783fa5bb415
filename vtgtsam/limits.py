# SPDX-License-Identifier: MIT
"""How much is taken from a file before it is refused: far more than real ones have, far less than harms.

Files come from strangers, and a few bytes can ask for terabytes. All limits are here, and docs/limits.md says
what each means. ``VTGTSAM_LIMITS`` raises all of them at once: 10 makes each ten times as large.
"""

from __future__ import annotations

import math
import os

from .exceptions import VtgtsamError

SETTING = "VTGTSAM_LIMITS"

MiB = 1 << 20

# Recordings
CHUNK_BYTES = 256 * MiB  # of one compressed chunk, unpacked
UNPACKED_BYTES = 1024 * MiB  # of a whole recording, unpacked, and
UNPACKED_RATIO = 200  # so many times its size on disk besides
MESSAGES = 500_000  # in a recording, and
MESSAGES_PER_BYTE = 1 / 8  # so many for each of its bytes besides
ATTACHED_BYTES = 256 * MiB  # of one attachment
FRAMES = 100_000  # in a recording, and
FRAMES_PER_MESSAGE = 10  # so many for each message besides
PIXELS = 100_000_000  # of one image

# Meshes, fields and hands
MESH_BYTES = 1024 * MiB
FACES = 5_000_000
VERTICES = 5_000_000
NODES = 512**3  # of a distance field
PAD_SIDE = 0.5  # [m], no pad of a hand is larger
PAD_POINTS = 1_000_000  # of all pads of a hand
XML_BYTES = 64 * MiB  # of a hand's description with all that it includes
XML_ELEMENTS = 100_000  # of it, repeated ones as often as they are repeated
XML_DEPTH = 200
XML_NUMBER = 1_000_000  # for counts, sizes and resolutions in it

# Text
TEXT_BYTES = 16 * MiB  # of a YAML or JSON file, and of a table of poses 64 times as much
TEXT_DEPTH = 100  # of what is nested in it
TEXT_ITEMS = 1_000_000  # in it, with repeated ones as often as they are repeated


def factor() -> float:
    """How many times the limits are raised.

    Raises:
        VtgtsamError: The setting is no number above 0.
    """
    text = os.environ.get(SETTING, "1")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not value > 0:
        raise VtgtsamError(f"{SETTING} must be a number above 0, got {text!r}")
    return value


def check(number: float, limit: float, what: str, error: type[VtgtsamError] = VtgtsamError) -> None:
    """Refuse what is beyond a limit.

    Args:
        number: What came.
        limit: One of this module's numbers, as it is without the setting.
        what: What was counted, as in "faces in can.obj".
        error: Kind of the error.

    Raises:
        VtgtsamError: Of that kind.
    """
    most = limit * factor()
    if not number <= most:
        raise error(
            f"{number:,.12g} {what} are more than {most:,.12g}; if that is meant, raise all limits with the "
            f"environment variable {SETTING}, as in {SETTING}=10"
        )
