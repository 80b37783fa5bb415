# SPDX-License-Identifier: MIT
"""What a recording or a live run looks like in Rerun: one scene, from files or as it happens.

Raises:
    VtgtsamError: On import, where Rerun is not installed.
"""

from importlib.util import find_spec

from ..exceptions import VtgtsamError

if find_spec("rerun") is None:
    raise VtgtsamError("the viewer needs Rerun; type: pip install 'vtgtsam[viz]'")
