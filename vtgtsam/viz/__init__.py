# SPDX-License-Identifier: MIT
"""What a recording or a live run looks like in Rerun: one scene, from files or as it happens.

Raises:
    MissingExtraError: On import, where Rerun is not installed.
"""

from ..extras import require

require("viz", "the viewer needs")
