# SPDX-License-Identifier: MIT
r"""The penetration term: object and hand do not interpenetrate (paper, eq. 2).

With phi_k the signed distance of the pad's grid point that is closest to the object at the pose in question,

    r_k(T_wo) = min(0, phi_k)    [m]    for every pad k, touching or not,

which pushes the object out of the pad. Not robust: geometry has no outliers.
"""

from __future__ import annotations

from ..compiled import inlined


@inlined
def penetration_loss(phi: float, weight: float) -> float:
    """Loss rho(e) = e = w min(0, phi)^2; the weight rho'(e) is 1."""
    depth = min(0.0, phi)
    return weight * depth * depth
