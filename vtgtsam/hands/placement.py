# SPDX-License-Identifier: MIT
"""Where a hand's pads lie on its links: a face inside its own link, or one that looks the wrong way, never touches.

The hand is open here (``neutral``).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from . import shapes

if TYPE_CHECKING:
    from .model import HandModel
    from .pad_boxes import PadBox

ABOVE = 5e-4  # [m], how far above a face it is asked whether that is inside a link
MOSTLY = 0.4  # of a face: more of it inside a link is a mistake
FLOATING = 0.01  # [m], of a face above its link's surface, beyond its own thickness
_Surface = tuple[np.ndarray, np.ndarray]  # vertices in frame h [m], triangles
Links = dict[int, list[_Surface]]
A_SIDE = 5  # points asked a side of a face


@dataclass(frozen=True)
class Placement:
    """How a pad lies on its link.

    Attributes:
        name: The pad's name.
        on_edge: Whether the box stands on edge: +z is not its thinnest side.
        inside: Share of the face that lies inside the pad's own link as it looks.
        enclosed: Share of it inside what its link collides with in a simulator.
        depth: How far straight above the face's centre the link ends [m]; 0 where it is outside.
        floats: Distance of the face's centre to the nearest surface of its link [m]; NaN where the link
            has no geometry.
        other: Another link that most of the face lies inside of, or None.
    """

    name: str
    on_edge: bool
    inside: float
    enclosed: float
    depth: float
    floats: float
    other: str | None


def neutral(model: mujoco.MjModel) -> np.ndarray:
    """An open hand: hinges at zero or nearest to it, jaws that slide as far from it as they go, shape (J,)."""
    limited = model.jnt_limited.astype(bool)
    low = np.where(limited, model.jnt_range[:, 0], -np.inf)
    high = np.where(limited, model.jnt_range[:, 1], np.inf)
    slides = limited & (model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE)
    return np.where(slides, np.where(-low > high, low, high), np.clip(0.0, low, high))


def placements(hand: HandModel) -> list[Placement]:
    """How each pad lies on its link."""
    model, data = hand.model, mujoco.MjData(hand.model)
    data.qpos[:] = neutral(model)
    mujoco.mj_kinematics(model, data)
    T_hp = hand.pad_transforms(data.qpos)
    links = _links(model, data, _pad_geoms(hand) | _unseen(model))
    all_links = _links(model, data, _pad_geoms(hand))
    found = []
    for box, T in zip(hand.pad_boxes, T_hp, strict=True):
        weld = int(model.body_weldid[box.body])
        own, inside = links[weld], _share_inside(_above(box, T), links[weld])
        found.append(
            Placement(
                box.name,
                on_edge=box.element is not None and bool(box.size[2] > 1.001 * box.size[:2].min()),
                inside=inside,
                enclosed=_share_inside(_above(box, T), all_links[weld]),
                depth=_way_out(T, own) if inside > 0 else 0.0,
                floats=_distance(T[:3, 3], own),
                other=covering(model, data, box, T, links),
            )
        )
    return found


def covering(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    box: PadBox,
    T_hp: np.ndarray,
    links: Links | None = None,
) -> str | None:
    """Name of another link that most of a pad's face lies inside of, or None.

    Args:
        model: The hand.
        data: Its state, after ``mj_kinematics``.
        box: The pad.
        T_hp: Pose of the pad in frame h, shape (4, 4).
        links: The links' surfaces where they are at hand.
    """
    points = _above(box, T_hp)
    own = int(model.body_weldid[box.body])
    for weld, surfaces in (links or _links(model, data, _unseen(model))).items():
        if weld != own and _share_inside(points, surfaces) > MOSTLY:
            bodies = np.flatnonzero((model.body_weldid == weld) & (model.body_geomnum > 0))
            return str(model.body(bodies[0]).name)
    return None


def _above(box: PadBox, T_hp: np.ndarray) -> np.ndarray:
    lifted: np.ndarray = T_hp[:3, 3] + ABOVE * T_hp[:3, 2]
    return np.asarray(_face_points(box.size) @ T_hp[:3, :3].T + lifted)


def warnings_of(hand: HandModel) -> list[str]:
    """What is wrong with the pads' places, one sentence each."""
    return list(sentences(hand, placements(hand)))


def sentences(hand: HandModel, found: Iterable[Placement]) -> Iterable[str]:
    """What is wrong with these places, one sentence each."""
    for place, box in zip(found, hand.pad_boxes, strict=True):
        if place.inside > MOSTLY:
            yield (
                f"{place.inside * 100:.0f} % of the face of pad {place.name!r} lies inside its own link "
                f"{_name(hand, box.body)!r} and can touch nothing; +z must point out of the link"
                + (
                    f", or the face lie {place.depth * 1e3:.1f} mm further out"
                    if place.depth
                    else ""
                )
            )
        elif place.on_edge:
            x, y, z = box.size * 1e3
            yield (
                f"pad {place.name!r} is a box of {x:.1f} x {y:.1f} x {z:.1f} mm whose +z face touches, and z is "
                "not its thinnest side; if it should be another face, list the pad in a YAML file with "
                "that face"
            )
        if place.other is not None:
            yield f"the face of pad {place.name!r} lies inside the link {place.other!r}"
        if place.floats > FLOATING + box.size[2]:
            yield (
                f"pad {place.name!r} floats {place.floats * 1e3:.0f} mm above its link "
                f"{_name(hand, box.body)!r}; is it fixed to the right body, and in metres?"
            )


def _name(hand: HandModel, body: int) -> str:
    return str(hand.model.body(body).name)


def _unseen(model: mujoco.MjModel) -> set[int]:
    return set(range(model.ngeom)) - set(shapes.shown_geoms(model))


def _pad_geoms(hand: HandModel) -> set[int]:
    """Geoms that are pads themselves."""
    names = {(box.element, box.body) for box in hand.pad_boxes if box.element is not None}
    model = hand.model
    bodies = model.geom_bodyid.tolist()
    return {
        i
        for i in range(model.ngeom)
        if (model.geom(i).name or model.body(bodies[i]).name, bodies[i]) in names
    }


def _links(model: mujoco.MjModel, data: mujoco.MjData, without: set[int]) -> Links:
    """The surfaces of bodies that are fixed to each other, by the first of these bodies."""
    welds = set(model.body_weldid.tolist())
    return {weld: _surfaces(model, data, without, weld) for weld in welds}


def _surfaces(
    model: mujoco.MjModel, data: mujoco.MjData, without: set[int], weld: int
) -> list[_Surface]:
    """Triangles in frame h of each geom of the bodies that are fixed to each other."""
    found = []
    for i in np.flatnonzero(model.body_weldid[model.geom_bodyid] == weld).tolist():
        triangles = None if i in without else shapes.geom_triangles(model, i)
        if triangles is not None:
            vertices = triangles[0] @ data.geom_xmat[i].reshape(3, 3).T + data.geom_xpos[i]
            found.append((vertices, np.asarray(triangles[1], dtype=np.int64)))
    return found


def _face_points(size: np.ndarray) -> np.ndarray:
    """A few points spread over a face, in the pad frame, shape (A_SIDE^2, 3)."""
    ticks = np.linspace(-0.4, 0.4, A_SIDE)
    x, y = np.meshgrid(ticks * size[0], ticks * size[1])
    return np.column_stack([x.ravel(), y.ravel(), np.zeros(A_SIDE**2)])


def _share_inside(points: np.ndarray, surfaces: list[_Surface]) -> float:
    import igl

    inside = np.zeros(len(points), dtype=bool)
    for vertices, faces in surfaces:
        near = ((points > vertices.min(axis=0)) & (points < vertices.max(axis=0))).all(axis=1)
        if near.any():
            inside[near] |= np.abs(igl.winding_number(vertices, faces, points[near])) > 0.5
    return float(inside.mean())


def _way_out(T: np.ndarray, surfaces: list[_Surface]) -> float:
    """How far above the face's centre the last surface of the link lies [m]."""
    import igl

    last = 0.0
    for vertices, faces in surfaces:
        hits = igl.ray_mesh_intersect(T[:3, 3], T[:3, 2], vertices, faces)
        last = max([last, *(float(hit[1]) for hit in hits)])
    return last


def _distance(point: np.ndarray, surfaces: list[_Surface]) -> float:
    import igl

    squared = [float(np.min(igl.point_mesh_squared_distance(point[None], *s)[0])) for s in surfaces]
    return float(np.sqrt(min(squared))) if squared else float("nan")
