# SPDX-License-Identifier: MIT
"""A first proposal of pads for a hand that has none: one on the palm side of each link that bends.

A finger bends towards what it grasps. So the palm side of a link is where its surface goes when its
joint closes, and a joint closes in the direction in which its range is longer; a jaw that slides closes
towards the others. The palm's side is the mean of its fingers'. On each link, straight rays from that
side find the surface; the pad is a rectangle on the part of it that is nearly flat, its face at the
highest point there.

It is a beginning, to be looked at (``vtgtsam check-hand``) and corrected by whoever knows the hand.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import mujoco
import numpy as np
import yaml

from ..exceptions import HandError
from . import file as hand_file
from . import placement, shapes
from .pad_boxes import listed, rotation_of
from .pad_file import PadEntry

SMALLEST = 0.006  # [m], side of a pad worth proposing: the rim alone takes 4 mm
FLAT = 0.004  # [m], how far below its highest point a surface still belongs to the pad
SPACING = 0.001  # [m], of the rays
STEP = 5e-4  # [m], to which what is written is rounded
JOINT_ROOM = 0.002  # [m], between a pad and the axes of the joints at both ends of its link
ONE_SIDED = (
    0.1  # how much longer one side of a joint's range is, as share of the whole, where it bends
)


def suggest_pads(path: str | Path) -> list[PadEntry]:
    """A pad for each link that bends and for the palm.

    Args:
        path: The hand's MJCF or URDF file.

    Raises:
        HandError: The file cannot be read, or no link of it has a shape and bends.
    """
    model = hand_file.compile_hand(hand_file.read_spec(Path(path)))
    data = mujoco.MjData(model)
    data.qpos[:] = placement.neutral(model)
    mujoco.mj_kinematics(model, data)
    proposed = [_pad(model, data, *side) for side in sorted(_sides(model, data).items())]
    entries = [entry for entry in proposed if entry is not None]
    entries = [entry for entry in entries if not _is_covered(model, data, entry)]
    if not entries:
        raise HandError(
            f"no pads can be proposed for {path}: no link that bends one way has a shape with a side of "
            f"{SMALLEST * 1e3:g} mm; write the pads file by hand (docs/pads.md)"
        )
    return entries


def pads_yaml(entries: Iterable[PadEntry], hand: str) -> str:
    """A pads file's text.

    Args:
        entries: The pads.
        hand: Path of the hand's file as the pads file should name it.
    """
    lines = [
        "# Proposed by vtgtsam suggest-pads. Positions and sizes are in metres, in each body's frame.",
        f"# Look at it with: vtgtsam check-hand {hand} --pads THIS_FILE --out hand.png",
        f"hand: {yaml.safe_dump(hand).splitlines()[0]}",
        "pads:",
    ]
    for entry in entries:
        content = entry.model_dump(exclude_defaults=True)
        flow = yaml.safe_dump(
            {key: list(v) if isinstance(v, tuple) else v for key, v in content.items()},
            default_flow_style=True,
            sort_keys=False,
            width=1000,
        )
        lines.append(f"  - {flow.strip()}")
    return "\n".join(lines) + "\n"


def _sides(model: mujoco.MjModel, data: mujoco.MjData) -> dict[int, np.ndarray]:
    """The palm side of each body that bends, and of the palm, a unit vector in frame h."""
    sides: dict[int, np.ndarray] = {}
    for joint in range(model.njnt):
        body = int(model.jnt_bodyid[joint])
        if (
            body not in sides
            and not _branches(model, body)
            and (side := _closing(model, data, joint)) is not None
        ):
            sides[body] = side
    for body in range(1, model.nbody):  # joints that spread a finger in the middle of it
        parent = int(model.body_parentid[body])
        jointed = model.body_jntnum[body] > 0 and not _branches(model, body)
        if body not in sides and jointed and parent in sides:
            sides[body] = sides[parent]
    bases: dict[int, list[np.ndarray]] = {}
    for body, side in sides.items():
        base = int(model.body_parentid[body])
        while base > 0 and base not in sides and not _branches(model, base):
            base = int(model.body_parentid[base])  # joints that spread the fingers
        if base not in sides:
            bases.setdefault(base, []).append(side)
    for base, of_fingers in bases.items():
        mean = np.mean(of_fingers, axis=0)
        if len(of_fingers) > 1 and base > 0 and np.linalg.norm(mean) > 0.3:
            sides[base] = mean / np.linalg.norm(mean)
    palms = [b for b in range(1, model.nbody) if _branches(model, b)]
    carries = {b for b in sides for palm in palms if b != palm and _is_below(model, palm, b)}
    return {body: side for body, side in sides.items() if body not in carries or body in palms}


def _branches(model: mujoco.MjModel, body: int) -> bool:
    """Whether several fingers begin at a body: a palm, whatever turns it."""
    children = np.flatnonzero(model.body_parentid == body)
    below = [b for b in children if b != body and _jointed_below(model, int(b))]
    return len(below) > 1


def _jointed_below(model: mujoco.MjModel, body: int) -> bool:
    return any(model.body_jntnum[b] > 0 and _is_below(model, b, body) for b in range(model.nbody))


def _closing(model: mujoco.MjModel, data: mujoco.MjData, joint: int) -> np.ndarray | None:
    """Where the far end of a link goes when its joint closes; None where it bends both ways alike."""
    if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE:
        return _towards_others(model, data, joint)
    low, high = model.jnt_range[joint]
    if not model.jnt_limited[joint]:
        return None
    if abs(low + high) < ONE_SIDED * (high - low):
        return None
    body = int(model.jnt_bodyid[joint])
    moved = [b for b in range(model.nbody) if _is_below(model, b, body)]
    ends = [data.geom_xpos[g] for g in range(model.ngeom) if model.geom_bodyid[g] in moved]
    if not ends:
        return None
    arms = np.array(ends) - data.xanchor[joint]
    far = arms[np.argmax(np.linalg.norm(arms, axis=1))]
    side = np.sign(low + high) * np.cross(data.xaxis[joint], far)
    length = float(np.linalg.norm(side))
    return None if length < 1e-3 else side / length


def _towards_others(model: mujoco.MjModel, data: mujoco.MjData, joint: int) -> np.ndarray | None:
    """Along a jaw's slide to the jaws that slide beside it."""
    body = int(model.jnt_bodyid[joint])
    slides = model.jnt_bodyid[model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE]
    parents = model.body_parentid
    beside = [b for b in slides if b != body and parents[b] == parents[body]]
    if not beside:
        return None
    axis: np.ndarray = data.xaxis[joint]
    other = np.mean([_center(model, data, int(b)) for b in beside], axis=0)
    along = float(axis @ (other - _center(model, data, body)))
    return None if abs(along) < 1e-3 else np.sign(along) * axis


def _center(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> np.ndarray:
    """Middle of what is fixed to a body, in frame h [m]."""
    own = model.body_weldid[model.geom_bodyid] == model.body_weldid[body]
    return np.asarray(data.geom_xpos[own].mean(axis=0) if own.any() else data.xpos[body])


def _is_below(model: mujoco.MjModel, body: int, ancestor: int) -> bool:
    while body > ancestor:
        body = int(model.body_parentid[body])
    return body == ancestor


def _pad(
    model: mujoco.MjModel, data: mujoco.MjData, body: int, side_h: np.ndarray
) -> PadEntry | None:
    """The pad on one side of a body and what is fixed to it; None where there is no room."""
    R_hb, p_hb = data.xmat[body].reshape(3, 3), data.xpos[body]
    side = R_hb.T @ side_h
    axis = int(np.argmax(np.abs(side)))
    if abs(side[axis]) > 0.8:  # links are drawn along their frame's axes
        side = np.sign(side[axis]) * np.eye(3)[axis]
    vertices, faces = _link(model, data, body)
    if len(faces) == 0:
        return None
    vertices = (vertices - p_hb) @ R_hb
    z = side / np.linalg.norm(side)
    x = np.eye(3)[int(abs(z[0]) > 0.9)]
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    R_bp = np.column_stack([x, np.cross(z, x), z])
    found = _rectangle(vertices @ R_bp, faces, _between_joints(model, body) @ R_bp)
    if found is None:
        return None
    center, size = found
    pos = STEP * np.round(R_bp @ center / STEP)
    size = STEP * np.floor(size / STEP + 1e-6)
    name = model.body(body).name
    return PadEntry.model_validate(
        {
            "name": f"pad_{name}",
            "body": name,
            "pos": np.round(pos, 6).tolist(),
            "normal": (np.round(z, 4) + 0.0).tolist(),
            "size": np.round(size, 6).tolist(),
        }
    )


def _link(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles in frame h of a body's shapes, seen or only touched, with the bodies fixed to it."""
    vertices, faces, count = [np.empty((0, 3))], [np.empty((0, 3), dtype=np.int64)], 0
    weld = model.body_weldid[body]
    for i in range(model.ngeom):
        if model.body_weldid[model.geom_bodyid[i]] != weld:
            continue
        triangles = shapes.geom_triangles(model, i)
        if triangles is not None:
            R = data.geom_xmat[i].reshape(3, 3)
            vertices.append(triangles[0] @ R.T + data.geom_xpos[i])
            faces.append(np.asarray(triangles[1], dtype=np.int64) + count)
            count += len(triangles[0])
    return np.concatenate(vertices), np.concatenate(faces)


def _between_joints(model: mujoco.MjModel, body: int) -> np.ndarray:
    """Where the joints at both ends of a link lie in its frame [m], shape (0, 1 or 2, 3)."""
    if model.body_jntnum[body] == 0:
        return np.empty((0, 3))
    own = model.jnt_pos[model.body_jntadr[body]]
    children = [
        model.body_pos[b] + rotation_of(model.body_quat[b]) @ model.jnt_pos[model.body_jntadr[b]]
        for b in np.flatnonzero(model.body_parentid == body)
        if b != body and model.body_jntnum[b] > 0
    ]
    return np.array([own, *children[:1]])


def _is_covered(model: mujoco.MjModel, data: mujoco.MjData, entry: PadEntry) -> bool:
    """Whether the face lies mostly inside other links."""
    (box,) = listed(model, [entry])
    T_hb = np.eye(4)
    T_hb[:3, :3], T_hb[:3, 3] = data.xmat[box.body].reshape(3, 3), data.xpos[box.body]
    return placement.covering(model, data, box, T_hb @ box.T_bp) is not None


def _rectangle(
    vertices: np.ndarray, faces: np.ndarray, joints: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """Centre, at its highest point, and sides of the flat part of a surface seen from +z [m].

    Args:
        vertices: Of the surface, in the pad's axes.
        faces: Its triangles.
        joints: Joints at the ends of the link, which the pad stays between.
    """
    import igl

    low, high = vertices.min(axis=0), vertices.max(axis=0)
    if len(joints) > 0:
        middle = (low + high) / 2 if len(joints) == 1 else joints.mean(axis=0)
        along = int(np.argmax(np.abs((middle - joints[0])[:2])))
        for joint in joints[:, along]:
            if joint < middle[along]:
                low[along] = max(low[along], joint + JOINT_ROOM)
            else:
                high[along] = min(high[along], joint - JOINT_ROOM)
    x = np.arange(low[0] + SPACING / 2, high[0], SPACING)
    y = np.arange(low[1] + SPACING / 2, high[1], SPACING)
    if len(x) * SPACING < SMALLEST or len(y) * SPACING < SMALLEST:
        return None
    from_above = np.array([(a, b, high[2] + 0.01) for a in x for b in y])
    tree = igl.AABB()
    tree.init(vertices, faces)
    down = np.tile([0.0, 0.0, -1.0], (len(from_above), 1))
    hit, length, _ = tree.intersect_ray_first(vertices, faces, from_above, down)
    heights = np.where(hit >= 0, from_above[:, 2] - length, -np.inf).reshape(len(x), len(y))
    top = float(np.quantile(heights[heights > -np.inf], 0.95))
    flat = (heights > top - FLAT) & (heights < top + FLAT)
    (i0, i1), (j0, j1) = _largest(flat)
    size = SPACING * np.array([i1 - i0, j1 - j0])
    if size.min() < SMALLEST:
        return None
    inside = heights[i0:i1, j0:j1]
    center = np.array([(x[i0] + x[i1 - 1]) / 2, (y[j0] + y[j1 - 1]) / 2, inside.max()])
    return center, size


def _largest(flat: np.ndarray) -> tuple[tuple[int, int], tuple[int, int]]:
    """The largest rectangle of a mask that holds nothing else: rows from, to; columns from, to."""
    best, found = 0, ((0, 0), (0, 0))
    above = np.zeros(flat.shape[1], dtype=int)  # how many rows up from here are set, a column
    for i, row in enumerate(flat):
        above = np.where(row, above + 1, 0)
        for height in np.unique(above[above > 0]):
            wide = np.flatnonzero(np.diff(np.concatenate([[0], (above >= height), [0]])))
            for start, end in wide.reshape(-1, 2):
                if height * (end - start) > best:
                    best = int(height * (end - start))
                    found = ((i + 1 - int(height), i + 1), (int(start), int(end)))
    return found
