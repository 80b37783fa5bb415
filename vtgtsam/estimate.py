# SPDX-License-Identifier: MIT
"""What the estimator answers each frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import gtsam
import numpy as np

from .faults.events import Event
from .modes import Mode

Status = Literal["ok", "waiting", "stalled", "unobservable", "contradicted", "lost", "invalid"]


@dataclass(frozen=True, eq=False)
class Estimate:
    """The object's pose in one frame, and how far to trust it.

    Attributes:
        time: The measurement's instant [s].
        T_wo: The object's pose in the world, or None while waiting for a first visual pose.
        covariance: Covariance of the pose's tangent vector (right perturbation), shape (6, 6), rotation
            [rad^2] first, then translation [m^2]: the inverse of the undamped robust information, infinite
            along directions that nothing measures; with memory the posterior's. On top comes what the robot's
            camera and joint zeros leave uncertain. It is the model's: with the literal weights (1, 1, 1) it
            means little.
        status: ``ok``;
            ``waiting``: no visual pose has come yet, so there is no pose;
            ``stalled``: the solver found no way down although its model promised one, the pose is the start;
            ``unobservable``: no visual pose this frame, and the pads leave some direction free;
            ``lost``: the visual pose is too far away to count, and the pads leave some direction free:
            nothing holds the pose;
            ``contradicted``: vision and touch cannot both be right: no contact of a pad counts any more, or the
            visual pose is refused while the hand holds the object;
            ``invalid``: the measurement has no finite time, or nothing in it could be used; the pose is the last.
        faults: What is wrong with the measurements, in the fixed words of ``vtgtsam.faults.words``.
        mode: How the object moves in the hand, ``free``, ``moving`` or ``held``; None without memory.
        events: What began in this frame: ``grasped``, ``slipping``, ``dropped``.
        iterations: Iterations the solver took.
        error: Cost at the pose, 1/2 sum rho.
        visual_weight: How much the visual pose counts after its robust loss, in [0, 1]; 0 where there is none. A late
            one is judged in the frame of its own instant.
        pad_distances: Signed distance of each pad to the object [m], shape (K,).
        pad_weights: How much each pad's contact counts after its robust loss, in [0, 1], shape (K,); 0 where
            a pad reports no contact.
        contact_points_w: Each pad's closest point in the world [m], shape (K, 3); NaN where the search left
            a pad out.
    """

    time: float
    T_wo: gtsam.Pose3 | None
    covariance: np.ndarray
    status: Status
    faults: tuple[str, ...]
    mode: Mode | None
    events: tuple[Event, ...]
    iterations: int
    error: float
    visual_weight: float
    pad_distances: np.ndarray
    pad_weights: np.ndarray
    contact_points_w: np.ndarray

    def __str__(self) -> str:
        """The pose with its one-sigma uncertainty, and what to think of it, in a few lines."""
        lines = [f"t = {self.time:.3f} s: {', '.join([self.status, *filter(None, [self.mode])])}"]
        if self.T_wo is not None:
            sigma = np.sqrt(np.diag(self.covariance))
            x, y, z = 1e3 * self.T_wo.translation()
            roll, pitch, yaw = np.rad2deg(self.T_wo.rotation().rpy()) + 0.0  # no -0.0
            lines += [
                f"  at {x:.1f}, {y:.1f}, {z:.1f} mm, {_uncertainty(1e3 * sigma[3:], 'mm')}",
                f"  roll {roll:.1f}, pitch {pitch:.1f}, yaw {yaw:.1f} degrees, "
                f"{_uncertainty(np.rad2deg(sigma[:3]), 'degrees')}",
            ]
        counting = int(np.count_nonzero(self.pad_weights > 0.5))
        lines.append(
            f"  the visual pose counts {self.visual_weight:.0%}, {counting} of {len(self.pad_weights)} pads hold"
        )
        lines += [f"  {', '.join(self.events)}"] if self.events else []
        lines += [f"  fault: {fault}" for fault in self.faults]
        return "\n".join(lines)


def _uncertainty(sigma: np.ndarray, unit: str) -> str:
    """The largest of the axes' sigmas in words."""
    if not np.isfinite(sigma).all():
        return "one direction or more not known"
    return f"sure to {sigma.max():.2g} {unit}"
