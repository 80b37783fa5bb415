# SPDX-License-Identifier: MIT
r"""A signed distance field on a regular grid, with the exact gradient of its trilinear value.

The distance is positive outside the object and negative inside [m]. Between nodes the value is
trilinear and the gradient is that value's own derivative, so that finite differences of the value
agree with it (it jumps between cells). Outside the grid, as in the paper (section III-C),

    phi(x) = phi(c) + |x - c|,    c = x clamped to the grid.
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..atomic import replacing
from ..cache import read_arrays
from ..exceptions import MeshError
from .kernels import steepest, value_and_gradient_at, value_at

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class GridSdf:
    """Signed distance field of an object in its own frame.

    Attributes:
        values: Distances at the nodes [m], float32, shape (nx, ny, nz), at least two nodes an axis.
        lower: Position of the first node [m], shape (3,).
        upper: Position of the last node [m], shape (3,).
    """

    def __init__(self, values: ArrayLike, lower: ArrayLike, upper: ArrayLike) -> None:
        self.values = np.array(values, dtype=np.float32, order="C")  # its own, to be kept as it is
        self.lower = np.array(lower, dtype=np.float64)
        self.upper = np.array(upper, dtype=np.float64)
        if self.values.ndim != 3 or min(self.values.shape) < 2:
            raise ValueError(
                f"values must have shape (nx, ny, nz), at least 2 each, got {self.values.shape}"
            )
        if self.lower.shape != (3,) or self.upper.shape != (3,):
            raise ValueError(
                "lower and upper must have shape (3,), "
                f"got {self.lower.shape} and {self.upper.shape}"
            )
        if not (np.isfinite(self.lower).all() and np.isfinite(self.upper).all()):
            raise ValueError(f"lower and upper must be finite, got {self.lower} and {self.upper}")
        if not (self.lower < self.upper).all():
            raise ValueError(f"lower must be below upper, got {self.lower} and {self.upper}")
        if not np.isfinite(self.values).all():
            count = int((~np.isfinite(self.values)).sum())
            raise ValueError(f"values must be finite, {count} of {self.values.size} nodes are not")
        self.scale = (np.array(self.values.shape) - 1.0) / (self.upper - self.lower)  # [cells/m]
        self._lock()

    def _lock(self) -> None:
        """Refuse writing to the arrays: what is derived from them would not follow."""
        for array in (self.values, self.lower, self.upper, self.scale):
            array.flags.writeable = False

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._lock()  # a copy's arrays can be written to at first, and would be compiled for once more

    @cached_property
    def lipschitz(self) -> float:
        """Most that the distance changes per metre inside the grid; outside it is ``hypot(lipschitz, 1)``."""
        return float(steepest(self.values, self.scale))

    @cached_property
    def largest(self) -> float:
        """Largest absolute distance at a node [m]."""
        return float(np.abs(self.values).max())

    @property
    def spacing(self) -> np.ndarray:
        """Distance between nodes along each axis [m], shape (3,)."""
        return 1.0 / self.scale

    def value(self, points_o: ArrayLike) -> np.ndarray:
        """Signed distances [m], shape (N,), at ``points_o`` (N, 3) [m]; NaN where a point is not finite."""
        return value_at(self.values, self.lower, self.scale, _points(points_o))

    def value_and_gradient(self, points_o: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Signed distances [m], shape (N,), and their gradients, shape (N, 3), at ``points_o`` (N, 3) [m].

        The gradient's norm is near 1, up to sqrt(2) outside the grid. NaN where a point is not finite.
        """
        return value_and_gradient_at(self.values, self.lower, self.scale, _points(points_o))

    def save(self, path: str | Path) -> None:
        """Write to an ``.npz`` file (not compressed: it loads several times faster)."""
        path = Path(path)
        if path.suffix != ".npz":
            raise ValueError(f"a distance field is saved as .npz, got {path.name!r}")
        with replacing(path) as temporary, temporary.open("wb") as file:
            np.savez(file, values=self.values, lower=self.lower, upper=self.upper)

    @classmethod
    def load(cls, path: str | Path) -> GridSdf:
        """Read what ``save`` wrote.

        Raises:
            FileNotFoundError: There is no such file.
            MeshError: The file is not a distance field.
        """
        try:
            arrays = read_arrays(Path(path))
            return cls(arrays["values"], arrays["lower"], arrays["upper"])
        except (FileNotFoundError, MemoryError):
            raise
        except Exception as error:  # np.load raises a handful of kinds on a damaged file
            raise MeshError(
                f"{path} is not a distance field that GridSdf.save wrote ({error}); build it again"
            ) from error

    def __repr__(self) -> str:
        shape = "x".join(str(n) for n in self.values.shape)
        return f"GridSdf({shape}, lower={self.lower.tolist()}, upper={self.upper.tolist()})"


def _points(points: ArrayLike) -> np.ndarray:
    array = np.ascontiguousarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"points must have shape (N, 3), got {array.shape}")
    return array
