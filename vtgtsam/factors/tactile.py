# SPDX-License-Identifier: MIT
r"""The tactile term: a pad that reports contact touches the object's surface (paper, eq. 1).

With phi_k the signed distance of the pad's grid point that is closest to the object at the pose in question,

    r_k(T_wo) = max(0, phi_k)    [m]    for each pad k in contact,

so a gap pulls the surface onto the pad, and a penetration is left to the penetration term. Each pad has a Welsch loss
of its own: an outlier silences itself only.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import inlined


@inlined
def tactile_loss(phi: float, weight: float, theta: float) -> Any:
    """Loss rho(e) and the weight rho'(e) it leaves, for e = w max(0, phi)^2."""
    gap = max(0.0, phi)
    e = weight * gap * gap / theta
    return -theta * np.expm1(-e), np.exp(-e)
