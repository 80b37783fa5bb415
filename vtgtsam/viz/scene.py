# SPDX-License-Identifier: MIT
"""Hand, pads, object, camera and plots as Rerun shows them, written instant by instant.

A recording and a live run use the same scene, so that both look the same. Entities:

    world/hand/links/<link>      the hand's links, moved by its joints
    world/hand/pads              its pads: gray; in contact from blue (not believed) to yellow (believed)
    world/object/<name>          the object at the truth and at each method's estimate
    world/uncertainty/<name>     where its centre is with 95 %, given its covariance
    world/contacts               closest points of touching pads, in their colours
    world/camera                 the camera, its depth and colour images
    plots/<quantity>/<name>      numbers over time
    status/<name>                a method's status, whenever it changes
    streams                      how a live run's streams are, in words
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import gtsam
import mujoco
import numpy as np
import rerun as rr
from scipy.spatial.transform import Rotation

from ..covariance import center_ellipsoid
from ..hands.shapes import link_meshes
from ..recording.images import encode_color, encode_depth
from . import colors, names

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..camera import CameraIntrinsics
    from ..hands.model import HandModel
    from ..objects import ObjectModel

POINT_SIZE = 0.25  # [pixels], of a depth image's points in space: the rest is seen between them
PAD_THICKNESS = 0.0016  # [m], of the drawn pad; half of it lies above the contact face, to be seen
LINK_OPACITY = 110  # of 255: the pads of a closed hand are seen through its links
OPACITY = 150  # of 255, of objects
CAMERA_SIZE = 0.05  # [m], distance at which the camera's image plane is drawn
POINT_RADIUS = 0.003  # [m]
CALENDAR_S = 1e9  # [s], clocks beyond this count from 1970


class Scene:
    """Draws into one Rerun stream; use it from one thread.

    Args:
        stream: Where to draw.
        hand: The hand; an independent copy is kept.
        obj: The object.
        camera_is_world: Whether the world frame is the camera's, y down and z forward; else z is up.
    """

    def __init__(
        self,
        stream: rr.RecordingStream,
        hand: HandModel,
        obj: ObjectModel,
        camera_is_world: bool = False,
    ) -> None:
        self._stream = stream
        self._hand = copy.copy(hand)
        self._data = mujoco.MjData(hand.model)
        self._obj = obj
        self._palette = colors.Palette()
        self._drawn: set[str] = set()
        self._status: dict[str, str] = {}
        self._bodies = self._draw_links()
        axes = rr.ViewCoordinates.RDF if camera_is_world else rr.ViewCoordinates.RIGHT_HAND_Z_UP
        stream.log(names.WORLD, axes, static=True)

    def at(self, time: float) -> None:
        """All that follows belongs to this instant [s], of any clock."""
        if time > CALENDAR_S:
            self._stream.set_time(names.TIME, timestamp=time)
        else:
            self._stream.set_time(names.TIME, duration=time)

    def hand(
        self,
        joints: Mapping[str, float] | ArrayLike,
        T_wh: gtsam.Pose3,
        contacts: np.ndarray,
        weights: np.ndarray | None = None,
    ) -> None:
        """The hand and its pads.

        Args:
            joints: Joint angles [rad], as ``HandModel.joint_array`` takes them.
            T_wh: Pose of the hand in the world.
            contacts: Contact bits, shape (K,).
            weights: How much each pad's contact counts, in [0, 1], shape (K,); None: in full.
        """
        self._stream.log(f"{names.WORLD}/hand", _transform(T_wh))
        self._data.qpos[:] = self._hand.joint_array(joints)
        mujoco.mj_kinematics(self._hand.model, self._data)
        for body, path in self._bodies.items():
            quat_wxyz = self._data.xquat[body]
            transform = rr.Transform3D(
                translation=self._data.xpos[body], quaternion=np.roll(quat_wxyz, -1)
            )
            self._stream.log(path, transform)
        self._draw_pads(joints, contacts, np.ones(len(contacts)) if weights is None else weights)

    def object(self, name: str, T_wo: gtsam.Pose3) -> None:
        """The object at the pose that ``name`` (the truth, a method) gives it."""
        path = pose_path(name)
        if name not in self._drawn:  # not before its first pose, or it would stand at the origin
            self._draw_object(path, name)
            self._drawn.add(name)
        self._stream.log(path, _transform(T_wo))

    def uncertainty(self, name: str, T_wo: gtsam.Pose3, covariance: np.ndarray) -> None:
        """Where the object's centre is with 95 %; nothing where its covariance is infinite.

        Args:
            name: Who says so.
            T_wo: The pose.
            covariance: Of its right perturbation, rotation first, shape (6, 6).
        """
        path = uncertainty_path(name)
        center_o = self._obj.center
        region = center_ellipsoid(T_wo.rotation().matrix(), covariance, center_o)
        if region is None:
            self._stream.log(path, rr.Clear(recursive=False))
            return
        half, axes = region
        ellipsoid = rr.Ellipsoids3D(
            centers=[T_wo.transformFrom(center_o)],
            half_sizes=[half],
            quaternions=[Rotation.from_matrix(axes).as_quat()],  # xyzw
            colors=[self._palette.of(name)],
            fill_mode="majorwireframe",
        )
        self._stream.log(path, ellipsoid)

    def contact_points(
        self, points_w: np.ndarray, contacts: np.ndarray, weights: np.ndarray
    ) -> None:
        """Where touching pads are closest to the object.

        Args:
            points_w: Each pad's closest point in the world [m], shape (K, 3), NaN where there is none.
            contacts: Contact bits, shape (K,).
            weights: How much each contact counts, in [0, 1], shape (K,).
        """
        shown = contacts & np.isfinite(points_w).all(axis=1)
        points = rr.Points3D(
            points_w[shown],
            radii=POINT_RADIUS,
            colors=colors.of_pads(contacts[shown], weights[shown]),
        )
        self._stream.log(f"{names.WORLD}/contacts", points)

    def words(self, text: str) -> None:
        """How the streams are, in Markdown; only the newest is kept."""
        document = rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN)
        self._stream.log(names.WORDS, document, static=True)

    def camera(self, intrinsics: CameraIntrinsics, T_wc: gtsam.Pose3) -> None:
        """The camera's pose and view."""
        pinhole = rr.Pinhole(
            image_from_camera=intrinsics.matrix,
            width=intrinsics.width,
            height=intrinsics.height,
            camera_xyz=rr.ViewCoordinates.RDF,
            image_plane_distance=CAMERA_SIZE,
        )
        self._stream.log(f"{names.WORLD}/camera", _transform(T_wc), pinhole)

    def depth(self, image: np.ndarray) -> None:
        """A depth image [m], shape (H, W), 0 where nothing was measured; to the millimetre."""
        picture = rr.EncodedDepthImage(
            blob=encode_depth(image),
            media_type="image/png",
            meter=1000.0,
            point_fill_ratio=POINT_SIZE,
        )
        self._stream.log(f"{names.WORLD}/camera/depth", picture)

    def color(self, image: np.ndarray) -> None:
        """A colour image, RGB, uint8, shape (H, W, 3)."""
        picture = rr.EncodedImage(contents=encode_color(image), media_type="image/jpeg")
        self._stream.log(f"{names.WORLD}/camera/color", picture)

    def plot(self, quantity: str, name: str, value: float) -> None:
        """One value of a line; NaN interrupts it."""
        path = plot_path(quantity, name)
        if path not in self._drawn:
            self._stream.log(path, self._line_style(quantity, name), static=True)
            self._drawn.add(path)
        self._stream.log(path, rr.Scalars(value))

    def status(self, name: str, status: str) -> None:
        """A method's status; written where it differs from the last one."""
        if self._status.get(name) != status:
            self._status[name] = status
            level = rr.TextLogLevel.INFO if status == "ok" else rr.TextLogLevel.WARN
            entry = rr.TextLog(f"{name}: {status}", level=level)
            self._stream.log(f"{names.LOG}/{rr.escape_entity_path_part(name)}", entry)

    def _line_style(self, quantity: str, name: str) -> rr.SeriesLines:
        if quantity in (names.PAD_DISTANCE, names.CONTACTS):  # the viewer's own colours
            return rr.SeriesLines(names=name, widths=1.0)
        return rr.SeriesLines(names=name, colors=self._palette.of(name), widths=1.5)

    def _draw_links(self) -> dict[int, str]:
        """Draw the links' shapes; paths by body id."""
        paths = {}
        for body, mesh in link_meshes(self._hand.model).items():
            link = rr.escape_entity_path_part(self._hand.model.body(body).name)
            paths[body] = f"{names.WORLD}/hand/links/{link}"
            shape = rr.Mesh3D(
                vertex_positions=mesh.vertices,
                triangle_indices=mesh.faces,
                vertex_normals=_normals(mesh.vertices, mesh.faces),
                vertex_colors=mesh.colors,
                albedo_factor=(255, 255, 255, LINK_OPACITY),
            )
            self._stream.log(paths[body], shape, static=True)
        return paths

    def _draw_pads(
        self,
        joints: Mapping[str, float] | ArrayLike,
        contacts: np.ndarray,
        weights: np.ndarray,
    ) -> None:
        T_hp = self._hand.pad_transforms(joints)
        sizes = np.array([pad.size for pad in self._hand.pads])
        boxes = rr.Boxes3D(
            centers=T_hp[:, :3, 3],
            half_sizes=np.column_stack([sizes / 2, np.full(len(sizes), PAD_THICKNESS / 2)]),
            quaternions=Rotation.from_matrix(T_hp[:, :3, :3]).as_quat(),  # xyzw
            colors=colors.of_pads(contacts, weights),
            fill_mode="solid",
            labels=list(self._hand.pad_names),
            show_labels=False,
        )
        self._stream.log(f"{names.WORLD}/hand/pads", boxes)

    def _draw_object(self, path: str, name: str) -> None:
        if self._obj.mesh is None:
            half = (self._obj.sdf.upper - self._obj.sdf.lower) / 2
            box = rr.Boxes3D(centers=[self._obj.center], half_sizes=[half])
            self._stream.log(path, box)
            return
        mesh = self._obj.mesh
        shape = rr.Mesh3D(
            vertex_positions=mesh.vertices,
            triangle_indices=mesh.faces,
            vertex_normals=mesh.vertex_normals,
            albedo_factor=[*self._palette.of(name), OPACITY],  # ellipsoids lie inside
        )
        self._stream.log(path, shape)


def pose_path(name: str) -> str:
    """Path of the object at the pose that ``name`` gives it."""
    return f"{names.WORLD}/object/{rr.escape_entity_path_part(name)}"


def uncertainty_path(name: str) -> str:
    """Path of the ellipsoid in which ``name`` expects the object's centre."""
    return f"{names.WORLD}/uncertainty/{rr.escape_entity_path_part(name)}"


def plot_path(quantity: str, name: str) -> str:
    """Path of a line in a plot."""
    return f"plots/{quantity}/{rr.escape_entity_path_part(name)}"


def _transform(pose: gtsam.Pose3) -> rr.Transform3D:
    quaternion: Any = pose.rotation().toQuaternion()
    return rr.Transform3D(translation=pose.translation(), quaternion=quaternion.coeffs())  # xyzw


def _normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Normals of vertices, shape (N, 3), means over their faces weighted by area."""
    corners = vertices[faces]
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros_like(vertices, dtype=np.float64)
    for k in range(3):
        np.add.at(normals, faces[:, k], crosses)
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals /= np.where(lengths > 0, lengths, 1.0)
    return normals
