# SPDX-License-Identifier: MIT
r"""Poses of another program, brought to our units, frame and instants.

The program's mesh may have another origin than ours. With its frame t at ``offset`` in the object frame,
axes alike, what it reports becomes

    T_co = T_ct T_to,    T_to = (I, -offset)
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import gtsam
import numpy as np

from ...exceptions import RecordingError
from .formats import Frame, PoseTable, read_table
from .numbering import Numbering, usual_numbering

ROTATION_TOLERANCE = 0.01  # of R'R - I, above which a matrix is no rotation that was rounded


@dataclass(frozen=True, eq=False)
class PoseFiles:
    """The poses in a file or folder.

    Attributes:
        path: Where they lie.
        table: What is written there.
        scale: Metres per unit of its translations.
        frame: Whether they are poses in the world, T_wo, or in the camera frame, T_co.
        offset: Origin of the program's mesh in the object frame [m], shape (3,).
        latency: How long after the image a pose is stamped [s].
        numbering: Which image each number is; None: as is usual.
    """

    path: Path
    table: PoseTable
    scale: float
    frame: Frame
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    latency: float = 0.0
    numbering: Numbering | None = None

    @classmethod
    def read(
        cls,
        path: str | Path,
        scale: float | None = None,
        frame: Frame | None = None,
        offset: Sequence[float] = (0.0, 0.0, 0.0),
        latency: float = 0.0,
        scene: int | None = None,
        obj: int | None = None,
        numbering: Numbering | None = None,
        time_scale: float = 1.0,
    ) -> PoseFiles:
        """Read what FoundationPose (a folder of matrices), bop_toolkit (csv) or evo (TUM) write.

        Args:
            path: The file or folder.
            scale: Metres per unit of the translations; None: as the format has it.
            frame: "world" or "camera"; None: as is usual for the format.
            offset: Origin of the program's mesh in the object frame [m], shape (3,).
            latency: How long after the image a pose is stamped [s]: true time = stamp - latency.
            scene: For BOP, the scene_id.
            obj: For BOP, the obj_id.
            numbering: Which image each number is, where that is not the usual.
            time_scale: Seconds per unit of a TUM file's stamps.

        Raises:
            RecordingError: The files cannot be read.
        """
        if scale is not None and not (np.isfinite(scale) and scale > 0):
            raise ValueError(f"scale must be a positive number of metres per unit, got {scale!r}")
        if not np.isfinite(latency):
            raise ValueError(f"latency must be finite, got {latency!r}")
        x, y, z = np.asarray(offset, dtype=np.float64).tolist()
        if not np.isfinite([x, y, z]).all():
            raise ValueError(f"offset must be three finite numbers [m], got {offset!r}")
        table = read_table(path, scene, obj, time_scale)
        return cls(
            Path(path),
            table,
            table.unit if scale is None else scale,
            frame or table.frame,
            (x, y, z),
            latency,
            numbering,
        )

    def replaced(self, scale: float | None = None, frame: Frame | None = None) -> PoseFiles:
        """The same poses, understood otherwise."""
        return dataclasses.replace(self, scale=scale or self.scale, frame=frame or self.frame)

    @property
    def poses(self) -> list[gtsam.Pose3 | None]:
        """T_wo or T_co of each pose in the file; None where a matrix is no pose."""
        T_to = gtsam.Pose3(gtsam.Rot3(), -np.array(self.offset))
        return [_pose(matrix, self.scale, T_to) for matrix in self.table.matrices]

    def times_ns(self, image_times: Sequence[float] | np.ndarray) -> np.ndarray:
        """True instant of each pose in the file [ns], int64, shape (N,).

        Args:
            image_times: Instants of the images that the program saw [s]; not needed for stamps.

        Raises:
            RecordingError: There are fewer images than the numbers want.
        """
        latency_ns = round(self.latency * 1e9)
        if self.table.stamps_ns is not None:
            return self.table.stamps_ns - latency_ns
        instants = np.rint(np.asarray(image_times, dtype=np.float64) * 1e9).astype(np.int64)
        assert self.table.images is not None
        numbering = self.numbering or usual_numbering(self.table.images, len(instants), self.path)
        images = numbering.images(self.table.images)
        if images.min() < 0 or images.max() >= len(instants):
            raise RecordingError(
                f"{self.path} has poses of images {images.min()} to {images.max()} (--first, --every), "
                f"but there are {len(instants)} images"
            )
        times: np.ndarray = instants[images] - latency_ns
        return times


def _pose(matrix: np.ndarray, scale: float, T_to: gtsam.Pose3) -> gtsam.Pose3 | None:
    R, t = matrix[:3, :3], matrix[:3, 3] * scale
    if not np.isfinite(matrix).all() or abs(matrix[3] - (0, 0, 0, 1)).max() > 1e-6:
        return None
    if abs(R.T @ R - np.eye(3)).max() > ROTATION_TOLERANCE or np.linalg.det(R) < 0:
        return None
    return gtsam.Pose3(gtsam.Rot3.ClosestTo(R), t).compose(T_to)
