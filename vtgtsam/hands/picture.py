# SPDX-License-Identifier: MIT
"""A picture of a hand with its pads and their normals, by ray casting: no display, no graphics driver.

Four views from far away. Links are grey; a pad's face is blue from the front, red from behind; what
is hidden is only outlined. Arrows are the normals, +z out of the pads; numbers stand for names.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np

from ..camera import CameraIntrinsics
from ..rays import RayCaster, RayGrid
from . import placement, shapes

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

    from .model import HandModel

SIDE = 560  # [pixels], of each of the four views
FAR = 12.0  # distance of the eye in lengths of the hand: lines that are parallel look so
ARROW = 0.012  # [m]
AXIS = 0.03  # [m], of the hand's own axes
HIDDEN = 1.5e-3  # [m], a pad so far behind a link's surface is hidden by it
FRONT, BACK = np.array((30, 110, 220)), np.array((210, 40, 40))
PAPER, LINK = np.array((255, 255, 255)), np.array((200, 202, 206))
INK = (20, 20, 20)
AXES = ((200, 30, 30), (30, 150, 30), (30, 60, 210))
VIEWS = ("towards the pads", "from behind", "from the side", "from above and aside")


def hand_picture(hand: HandModel) -> Image:
    """The open hand (``placement.neutral``) from four sides."""
    from PIL import Image, ImageDraw, ImageFont

    data = mujoco.MjData(hand.model)
    data.qpos[:] = placement.neutral(hand.model)
    mujoco.mj_kinematics(hand.model, data)
    font = ImageFont.load_default(15)
    sheet = Image.new("RGB", (2 * SIDE + 430, max(2 * SIDE, 60 + 20 * len(hand.pads))), "white")
    draw = ImageDraw.Draw(sheet)
    for n, (title, R_hv) in enumerate(zip(VIEWS, _directions(hand, data), strict=True)):
        corner = (SIDE * (n % 2), SIDE * (n // 2))
        sheet.paste(_View(hand, data, R_hv).image(), corner)
        draw.text((corner[0] + 10, corner[1] + 8), title, fill=INK, font=font)
    _legend(draw, hand, font)
    return sheet


def _legend(draw: ImageDraw, hand: HandModel, font: object) -> None:
    x = 2 * SIDE + 10
    draw.text((x, 8), f"{hand.name}: {len(hand.pads)} pads", fill=INK, font=font)  # type: ignore[arg-type]
    draw.text((x, 28), "axes of the hand's frame: x red, y green, z blue", fill=INK, font=font)  # type: ignore[arg-type]
    for k, pad in enumerate(hand.pads):
        a, b = pad.size * 1e3
        line = f"{k}  {pad.name}  {a:.1f} x {b:.1f} mm"
        draw.text((x, 54 + 20 * k), line, fill=INK, font=font)  # type: ignore[arg-type]


def _directions(hand: HandModel, data: mujoco.MjData) -> list[np.ndarray]:
    """Rotations R_hv of the views: x right, y down, z forward, in the hand's frame."""
    T_hp = hand.pad_transforms(data.qpos)
    mean = T_hp[:, :3, 2].mean(axis=0)
    normal = T_hp[0, :3, 2] if np.linalg.norm(mean) < 0.1 else mean
    normal = normal / np.linalg.norm(normal)
    places = _corners(hand.model, data)
    spread = places - places.mean(axis=0)
    spread = spread - np.outer(spread @ normal, normal)
    up = np.linalg.svd(spread, full_matrices=False)[2][0]  # along the fingers
    nearest = int(np.argmax(np.abs(up)))  # one of the hand's own axes, where one is near
    if abs(normal[nearest]) < 0.5:
        up = np.eye(3)[nearest]
    up = up if up @ _outwards(hand.model, data) >= 0 else -up
    side = np.cross(normal, up)
    slant = normal + side + 0.7 * up
    return [_looking(d, up) for d in (-normal, normal, -side, -slant)]


def _outwards(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """From the root to the tips: where bodies lie that many joints move."""
    joints = np.zeros(model.nbody)
    for body in range(1, model.nbody):
        joints[body] = joints[model.body_parentid[body]] + model.body_jntnum[body]
    spread: np.ndarray = (joints[1:] - joints[1:].mean()) @ data.xpos[1:]
    return spread


def _looking(forward: np.ndarray, up: np.ndarray) -> np.ndarray:
    z = forward / np.linalg.norm(forward)
    x = np.cross(z, up)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def _corners(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Corners of the boxes around what a hand looks like, or its bodies where that is nothing [m], (N, 3)."""
    corners = [data.xpos[1:]]
    signs = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T
    for i in shapes.shown_geoms(model):
        if model.geom_type[i] != mujoco.mjtGeom.mjGEOM_PLANE:
            center, half = model.geom_aabb[i, :3], model.geom_aabb[i, 3:]
            R = data.geom_xmat[i].reshape(3, 3)
            corners.append(data.geom_xpos[i] + (center + signs * half) @ R.T)
    return np.concatenate(corners)


class _View:
    """The hand from one side."""

    def __init__(self, hand: HandModel, data: mujoco.MjData, R_hv: np.ndarray) -> None:
        self.hand, self.data, self.R_hv = hand, data, R_hv
        self.T_hp = hand.pad_transforms(data.qpos)
        seen = np.concatenate([_corners(hand.model, data), self.T_hp[:, :3, 3]])
        low, high = (seen @ R_hv).min(axis=0), (seen @ R_hv).max(axis=0)
        self.extent = 1.12 * float(max(*(high - low)[:2], 1e-3)) + 2 * ARROW
        self.distance = FAR * max(self.extent, float(high[2] - low[2]))
        self.eye = R_hv @ ((low + high) / 2 - (0, 0, self.distance))
        self.focal = SIDE * self.distance / self.extent

    def image(self) -> Image:
        """The view, with pads, normals and numbers drawn over it."""
        from PIL import Image, ImageDraw

        pixels = np.arange(SIDE) - (SIDE - 1) / 2
        u, v = np.meshgrid(pixels / self.focal, pixels / self.focal)
        rays = np.column_stack([u.ravel(), v.ravel(), np.ones(SIDE**2)]) @ self.R_hv.T
        depth, colors = self._links(rays)
        for k in range(len(self.T_hp)):
            self._fill(k, rays, depth, colors)
        picture = Image.fromarray(colors.reshape(SIDE, SIDE, 3).astype(np.uint8))
        draw = ImageDraw.Draw(picture)
        for k in range(len(self.T_hp)):
            self._outline(draw, k)
        for axis, color in enumerate(AXES):
            ends = self._project(np.array([np.zeros(3), AXIS * np.eye(3)[axis]]))
            draw.line([tuple(end) for end in ends], fill=color, width=3)
        return picture

    def _links(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Depth of what each ray meets (inf where nothing), and its colour."""
        model = self.hand.model
        groups = tuple(set(model.geom_group[shapes.shown_geoms(model)].tolist()))
        center = (SIDE - 1) / 2
        camera = CameraIntrinsics(SIDE, SIDE, self.focal, self.focal, center, center)
        seen = RayCaster(model, groups).cast(
            self.data, self.eye, RayGrid.image(camera, self.R_hv, rays)
        )
        lit = 0.55 + 0.45 * np.abs(seen.normals_w @ self.R_hv[:, 2])
        met = seen.geom >= 0
        depth = np.where(met, seen.distance, np.inf)
        return depth, np.where(met[:, None], LINK * lit[:, None], PAPER)

    def _fill(self, k: int, rays: np.ndarray, depth: np.ndarray, colors: np.ndarray) -> None:
        """Paint a pad's face where no link hides it."""
        R, center = self.T_hp[k, :3, :3], self.T_hp[k, :3, 3]
        corners = self._project(self._corners(k))
        first = np.clip(np.floor(corners.min(axis=0)), 0, SIDE - 1).astype(int)
        last = np.clip(np.ceil(corners.max(axis=0)), 0, SIDE - 1).astype(int) + 1
        index = (
            np.arange(SIDE**2).reshape(SIDE, SIDE)[first[1] : last[1], first[0] : last[0]].ravel()
        )
        near = rays[index]
        slope = near @ R[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            far = np.where(slope == 0, np.inf, ((center - self.eye) @ R[:, 2]) / slope)
            on_face = (self.eye + far[:, None] * near - center) @ R[:, :2]
            inside = (np.abs(on_face) <= self.hand.pads[k].size / 2).all(axis=1)
        seen = index[inside & (far < depth[index] + HIDDEN)]
        color = FRONT if (center - self.eye) @ R[:, 2] < 0 else BACK
        colors[seen] = 0.35 * colors[seen] + 0.65 * color

    def _corners(self, k: int) -> np.ndarray:
        """Corners of a pad's face in frame h, the first again as the last, shape (5, 3)."""
        T = self.T_hp[k]
        signs = np.array([(1, 1), (1, -1), (-1, -1), (-1, 1), (1, 1)]) / 2
        on_face = np.column_stack([signs * self.hand.pads[k].size, np.zeros(5)])
        corners: np.ndarray = on_face @ T[:3, :3].T + T[:3, 3]
        return corners

    def _outline(self, draw: ImageDraw, k: int) -> None:
        from PIL import ImageFont

        T = self.T_hp[k]
        edge = [tuple(p) for p in self._project(self._corners(k))]
        draw.line(edge, fill=(90, 90, 110), width=1)
        tip = T[:3, 3] + ARROW * T[:3, 2]
        start, end = self._project(np.array([T[:3, 3], tip]))
        draw.line([tuple(start), tuple(end)], fill=INK, width=2)
        draw.ellipse([*(end - 3), *(end + 3)], fill=INK)
        draw.text(tuple(end + (5, -8)), str(k), fill=INK, font=ImageFont.load_default(14))

    def _project(self, points: np.ndarray) -> np.ndarray:
        """Pixels of points in frame h, shape (N, 2)."""
        p = (points - self.eye) @ self.R_hv
        pixels: np.ndarray = self.focal * p[:, :2] / p[:, 2:] + (SIDE - 1) / 2
        return pixels
