# SPDX-License-Identifier: MIT
r"""SE(3) exponential and logarithm in as few PyTorch calls as possible, translation first as in Theseus.

Torchlie's are general and take 50 to 200 small calls each; on one core a call costs a microsecond or so, whatever
its size, and these functions run at every pose. Here A = hat(xi) is 4x4, ad = ad(xi) 6x6, theta the angle, and

    exp(A)      = I + A + a2 A^2 + a3 A^3
    Jl(xi)^-1   = I - ad / 2 + b2 ad^2 + b4 ad^4

with coefficients that are power series in theta^2; nine terms are exact to double precision up to ``SMALL``.
Larger angles are left to torchlie.
"""

from __future__ import annotations

import torch
from torchlie.functional import SE3

SMALL = 0.5  # [rad]
TERMS = 9

_EXP = [  # a2 = (1 - cos t) / t^2, a3 = (t - sin t) / t^3
    [1 / 2, 1 / 6],
    [-1 / 24, -1 / 120],
    [1 / 720, 1 / 5040],
    [-1 / 40320, -1 / 362880],
    [1 / 3628800, 1 / 39916800],
    [-1 / 479001600, -1 / 6227020800],
    [1 / 87178291200, 1 / 1307674368000],
    [-1 / 20922789888000, -1 / 355687428096000],
    [1 / 6402373705728000, 1 / 121645100408832000],
]
# k  = 1 / t^2 - (1 + cos t) / (2 t sin t)
# b2 = 2 / t^2 + (t + 3 sin t) / (4 t (cos t - 1))
# b4 = 1 / t^4 + (t + sin t) / (4 t^3 (cos t - 1))
_LOG = [
    [1 / 12, 1 / 12, -1 / 720],
    [1 / 720, 0, -1 / 15120],
    [1 / 30240, -1 / 30240, -1 / 403200],
    [1 / 1209600, -1 / 604800, -1 / 11975040],
    [1 / 47900160, -1 / 15966720, -691 / 261534873600],
    [691 / 1307674368000, -691 / 326918592000, -1 / 12454041600],
    [1 / 74724249600, -1 / 14944849920, -3617 / 1524374691840000],
    [3617 / 10670622842880000, -3617 / 1778437140480000, -43867 / 638636777146368000],
    [43867 / 5109094217170944000, -43867 / 729870602452992000, -174611 / 89206406966476800000],
]


def _skew() -> torch.Tensor:
    """Levi-Civita symbol with skew(w)_ij = sum_k E_ijk w_k, (3, 3, 3)."""
    E = torch.zeros(3, 3, 3)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        E[i, j, k], E[j, i, k] = -1, 1
    return E


class Lie:
    """Exponential and logarithm for one dtype and device."""

    def __init__(self, dtype: torch.dtype, device: str) -> None:
        E = _skew()
        hat, ad = torch.zeros(4, 4, 6), torch.zeros(6, 6, 6)
        hat[:3, :3, 3:], hat[:3, 3, :3] = E, torch.eye(3)
        ad[:3, :3, 3:], ad[:3, 3:, :3], ad[3:, 3:, 3:] = E, E, E
        vee = torch.zeros(9, 3)
        vee[7, 0] = vee[2, 1] = vee[3, 2] = 0.5
        vee[5, 0] = vee[6, 1] = vee[1, 2] = -0.5

        def constant(value: object) -> torch.Tensor:
            return torch.as_tensor(value, dtype=dtype, device=device)

        self.hat, self.ad = constant(hat.reshape(16, 6).T), constant(ad.reshape(36, 6).T)
        self.vee, self.skew = constant(vee), constant(E.reshape(9, 3).T)
        self.exp_series, self.log_series = constant(_EXP), constant(_LOG)
        self.powers = torch.arange(TERMS, device=device)
        self.eye4, self.eye6 = constant(torch.eye(4)), constant(torch.eye(6))

    def exp(self, xi: torch.Tensor) -> torch.Tensor:
        """Poses (B, 3, 4) of twists (B, 6), translation first."""
        squared = xi[:, 3:].square().sum(1, keepdim=True)
        if squared.max() > SMALL**2:
            return SE3.exp(xi)
        a = squared**self.powers @ self.exp_series
        A = (xi @ self.hat).view(-1, 4, 4)
        A2 = A @ A
        return (self.eye4 + A + a[:, :1, None] * A2 + a[:, 1:, None] * (A2 @ A))[:, :3]

    def log(self, T: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Twists (B, 6) of poses (B, 3, 4), and the inverse of their left Jacobians (B, 6, 6)."""
        R, t = T[:, :, :3], T[:, :, 3]
        axis = R.reshape(-1, 9) @ self.vee
        sine = axis.norm(dim=1, keepdim=True)
        cosine = (R.diagonal(dim1=1, dim2=2).sum(1, keepdim=True) - 1) / 2
        angle = torch.atan2(sine, cosine)
        if angle.max() > SMALL:
            return self._torchlie_log(T)
        w = axis * ((angle + 1e-30) / (sine + 1e-30))
        c = (angle * angle) ** self.powers @ self.log_series
        W = (w @ self.skew).view(-1, 3, 3)
        Wt = W @ t[:, :, None]
        v = t - 0.5 * Wt[:, :, 0] + c[:, :1] * (W @ Wt)[:, :, 0]
        xi = torch.cat([v, w], dim=1)
        ad = (xi @ self.ad).view(-1, 6, 6)
        ad2 = ad @ ad
        return xi, self.eye6 - 0.5 * ad + c[:, 1:2, None] * ad2 + c[:, 2:, None] * (ad2 @ ad2)

    def _torchlie_log(self, T: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        jacobians: list[torch.Tensor] = []
        xi = SE3.log(T, jacobians=jacobians)
        return xi, self._left(xi, jacobians[0])

    def _left(self, xi: torch.Tensor, right: torch.Tensor) -> torch.Tensor:
        # Jl(xi)^-1 = Jr(-xi)^-1, and Jr^-1 - Jl^-1 = ad
        return right - (xi @ self.ad).view(-1, 6, 6)
