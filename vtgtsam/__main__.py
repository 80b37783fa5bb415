# SPDX-License-Identifier: MIT
"""``python -m vtgtsam``, and the command ``vtgtsam``."""

from __future__ import annotations

import sys

from .exceptions import MissingExtraError
from .extras import require


def main() -> None:
    """Run the command line of this process."""
    try:
        require("cli", "the command line needs")
    except MissingExtraError as error:
        sys.exit(f"vtgtsam: {error}")
    from .cli import main

    main()


if __name__ == "__main__":
    main()
