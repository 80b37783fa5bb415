# SPDX-License-Identifier: MIT
"""Object and contact points for RViz."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from ..estimate import Estimate
from ..live.fusion import Fused
from ..objects import ObjectModel
from .outgoing import fill_pose, stamped

POINT = 0.008  # [m], diameter of a contact point
LIFETIME_NS = 500_000_000  # what is not sent again disappears
BELIEVED, DOUBTED, REJECTED = (0.2, 0.8, 0.3), (1.0, 0.75, 0.1), (0.85, 0.15, 0.15)
SURE = 0.5  # weight of a contact that is believed


class Markers:
    """Makes the markers of a frame; a context manager that keeps the object's mesh where RViz can read it.

    Args:
        obj: The object.
        frame: Name of the world frame.
    """

    def __init__(self, obj: ObjectModel, frame: str) -> None:
        self._obj, self._frame = obj, frame
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._mesh: Path | None = None

    def __enter__(self) -> Markers:
        if self._obj.mesh is not None:
            self._folder = tempfile.TemporaryDirectory(prefix="vtgtsam-")
            self._mesh = Path(self._folder.name) / "object.stl"
            self._obj.mesh.export(self._mesh)
        return self

    def __exit__(self, *exception: object) -> None:
        if self._folder is not None:
            self._folder.cleanup()

    def of(self, fused: Fused) -> Any:
        """A visualization_msgs/msg/MarkerArray."""
        from visualization_msgs.msg import MarkerArray

        if fused.estimate.T_wo is None:
            return MarkerArray()
        stamp_ns, estimate = fused.cut.stamp_ns, fused.estimate
        points = self._points(stamp_ns, estimate, fused.cut.contacts)
        return MarkerArray(markers=[self._object(stamp_ns, estimate), points])

    def _marker(self, stamp_ns: int, name: str) -> Any:
        from visualization_msgs.msg import Marker

        marker = stamped(Marker(), stamp_ns, self._frame)
        marker.ns, marker.id, marker.action = name, 0, Marker.ADD
        marker.lifetime.nanosec = LIFETIME_NS
        return marker

    def _object(self, stamp_ns: int, estimate: Estimate) -> Any:
        marker = self._marker(stamp_ns, "object")
        assert estimate.T_wo is not None
        if self._mesh is not None:
            marker.type, marker.mesh_resource = marker.MESH_RESOURCE, f"file://{self._mesh}"
            scale = np.ones(3)
            fill_pose(marker.pose, estimate.T_wo)
        else:
            marker.type, sdf = marker.CUBE, self._obj.sdf
            scale = sdf.upper - sdf.lower
            fill_pose(marker.pose, estimate.T_wo.compose(_at((sdf.upper + sdf.lower) / 2)))
        marker.scale.x, marker.scale.y, marker.scale.z = scale.tolist()
        _paint(marker.color, BELIEVED if estimate.status == "ok" else DOUBTED, 0.6)
        return marker

    def _points(self, stamp_ns: int, estimate: Estimate, contacts: np.ndarray) -> Any:
        from geometry_msgs.msg import Point
        from std_msgs.msg import ColorRGBA

        marker = self._marker(stamp_ns, "contacts")
        marker.type = marker.SPHERE_LIST
        marker.pose.orientation.w = 1.0
        marker.scale.x = marker.scale.y = marker.scale.z = POINT
        for k in np.flatnonzero(contacts).tolist():
            point = estimate.contact_points_w[k]
            if np.isfinite(point).all():
                marker.points.append(Point(x=point[0], y=point[1], z=point[2]))
                sure = estimate.pad_weights[k] >= SURE
                marker.colors.append(_paint(ColorRGBA(), BELIEVED if sure else REJECTED, 1.0))
        if not marker.points:
            marker.action = marker.DELETE
        return marker


def _paint(color: Any, rgb: tuple[float, float, float], alpha: float) -> Any:
    color.r, color.g, color.b, color.a = *rgb, alpha
    return color


def _at(position: np.ndarray) -> Any:
    import gtsam

    return gtsam.Pose3(gtsam.Rot3(), position)
