# SPDX-License-Identifier: MIT
"""Tactile pads: rectangles covered with a grid of points that may touch the object.

A pad's frame p has its origin at the centre of the contact face and +z out of the pad.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from .. import limits

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

RIM = 0.002  # [m], radius of the rounded edge, where no contact point is sought (paper, section III-C)
SPACING = 0.001  # [m], between grid points (paper, section III-C)


def pad_grid(size: ArrayLike) -> np.ndarray:
    """Grid points on a pad's contact face [m], shape (M, 3), in the pad frame.

    Points lie 1 mm apart, centred, with the 2 mm rim excluded: floor((L - 4 mm) / 1 mm) + 1 a side.
    """
    length, width = (float(side) for side in np.asarray(size, dtype=np.float64))
    x, y = _axis(length), _axis(width)
    return np.column_stack([np.repeat(x, len(y)), np.tile(y, len(x)), np.zeros(len(x) * len(y))])


def _axis(length: float) -> np.ndarray:
    count = int((length - 2 * RIM) / SPACING + 1e-6) + 1  # 1e-6: 0.014 / 0.001 is 13.999...
    return (np.arange(count) - (count - 1) / 2) * SPACING


class Pad:
    """One tactile pad.

    Attributes:
        name: The pad's name, unique in its hand.
        size: Length along x and width along y of the contact face [m], shape (2,).
        points_p: Points that may touch the object [m], shape (M, 3), in the pad frame. Where not
            given, the grid of ``pad_grid``.
    """

    def __init__(self, name: str, size: ArrayLike, points_p: ArrayLike | None = None) -> None:
        if not isinstance(name, str):
            raise ValueError(f"a pad's name is a text, got {name!r:.80}")
        self.name = name
        self.size = np.array(size, dtype=np.float64)
        if self.size.shape != (2,) or not np.isfinite(self.size).all():
            raise ValueError(f"pad {name!r}: size must be (length, width) [m], got {size!r}")
        if self.size.max() > limits.PAD_SIDE * limits.factor():
            raise ValueError(
                f"pad {name!r} is {self.size[0]:.4g} x {self.size[1]:.4g} m, more than {limits.PAD_SIDE:g} m: "
                "it is probably in millimetres; a hand's file has to be in metres"
            )
        if points_p is None:
            if self.size.min() < 2 * RIM:
                raise ValueError(
                    f"pad {name!r} of {self.size[0] * 1e3:g} x {self.size[1] * 1e3:g} mm has no room "
                    f"inside its {RIM * 1e3:g} mm rim; make it larger or give points_p"
                )
            points_p = pad_grid(self.size)
        self.points_p = np.array(points_p, dtype=np.float64, order="C")
        if self.points_p.ndim != 2 or self.points_p.shape[1] != 3 or len(self.points_p) == 0:
            raise ValueError(
                f"pad {name!r}: points_p must have shape (M, 3) with M > 0, got {self.points_p.shape}"
            )
        if not np.isfinite(self.points_p).all():
            raise ValueError(f"pad {name!r}: points_p must be finite")
        self.size.flags.writeable = False
        self.points_p.flags.writeable = False

    def __repr__(self) -> str:
        return f"Pad({self.name!r}, size={self.size.tolist()}, {len(self.points_p)} points)"


class PadSet:
    """A hand known only by its pads.

    The caller's own kinematics gives each frame's pad poses in ``Measurement.T_wp``.

    Attributes:
        pads: The pads, in the order of contact bits and pad poses.
        pad_names: Their names, in the same order.
        points_p: All pads' points, each in its own pad's frame [m], shape (P, 3).
        offsets: Pad k's points are ``points_p[offsets[k]:offsets[k + 1]]``, shape (K + 1,).
    """

    def __init__(self, pads: Iterable[Pad]) -> None:
        if not isinstance(pads, Iterable):
            raise ValueError(f"a hand's pads are a list of Pad, got {pads!r:.80}")
        self.pads = tuple(pads)
        if not self.pads:
            raise ValueError("a hand needs at least one pad, got none")
        for pad in self.pads:
            if not isinstance(pad, Pad):
                raise ValueError(f"a hand's pads are a list of Pad, got {pad!r:.80} in it")
        self.pad_names = tuple(pad.name for pad in self.pads)
        doubles = sorted({name for name in self.pad_names if self.pad_names.count(name) > 1})
        if doubles:
            raise ValueError(f"pad names must be unique, these occur twice: {', '.join(doubles)}")
        points = sum(len(pad.points_p) for pad in self.pads)
        limits.check(points, limits.PAD_POINTS, "grid points of all pads")
        self.points_p = np.concatenate([pad.points_p for pad in self.pads])
        self.offsets = np.cumsum([0, *(len(pad.points_p) for pad in self.pads)])
        self.points_p.flags.writeable = False
        self.offsets.flags.writeable = False

    def __len__(self) -> int:
        return len(self.pads)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({len(self.pads)} pads, {len(self.points_p)} points)"
