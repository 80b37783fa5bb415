# SPDX-License-Identifier: MIT
"""Is a hand's description what its pads and joints are in truth? What is in it, and what is wrong."""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np

from . import placement, shapes
from .couplings import closed_chains, couplings
from .model import HandModel, numbered_out_of_order

LONGEST = 2.0  # [m], of a hand with its forearm; more is in millimetres
SHORTEST = 0.03  # [m]


@dataclass(frozen=True)
class HandReport:
    """What is known about a hand.

    Attributes:
        lines: Facts, one a line.
        notes: What a user should know, though nothing is wrong.
        problems: What is wrong and what to do about it, one sentence each.
    """

    lines: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        said = [f"note: {note}" for note in self.notes]
        said += [f"problem: {problem}" for problem in self.problems] or ["no problems found"]
        return "\n".join([*self.lines, *said])


def check_hand(hand: HandModel) -> HandReport:
    """Look a hand over: joints, ranges, pads, their normals and places, couplings, closed chains."""
    report = HandReport()
    lines, model = report.lines, hand.model
    visible = len(shapes.shown_geoms(model)) if model.ngeom else 0
    lines.append(
        f"{hand.name}: {len(hand.joint_names)} joints, {len(hand.pads)} pads, {model.nbody - 1} bodies, "
        f"{visible} shapes to see, {len(hand.points_p)} points on the pads"
    )
    lines += [
        "joints:",
        *_joints(hand),
        "pads, of the open hand (hinges at zero or nearest to it):",
    ]
    lines += _pads(hand)
    places = placement.placements(hand)
    report.notes.extend([*_notes(hand), *_enclosed(places)])
    report.problems.extend([*_size_problems(hand), *placement.sentences(hand, places)])
    return report


def _enclosed(places: list[placement.Placement]) -> list[str]:
    mostly = placement.MOSTLY
    names = [p.name for p in places if p.enclosed > mostly >= p.inside]
    if not names:
        return []
    return [
        f"the faces of {', '.join(names)} lie inside what their links collide with (shapes that are not "
        "seen): nothing in a simulator touches them"
    ]


def _joints(hand: HandModel) -> list[str]:
    model, followers = hand.model, couplings(hand.model)
    width = max((len(name) for name in hand.joint_names), default=0)
    lines = []
    for i, name in enumerate(hand.joint_names):
        slides = model.jnt_type[i] == mujoco.mjtJoint.mjJNT_SLIDE
        factor, unit = (1e3, "mm") if slides else (180 / np.pi, "deg")
        low, high = model.jnt_range[i] * factor
        span = f"{low:.1f} to {high:.1f} {unit}" if model.jnt_limited[i] else "without limits"
        line = f"  {name:<{width}}  {'slide' if slides else 'hinge'}  {span}"
        line += f"  moves {model.body(model.jnt_bodyid[i]).name}"
        if name in followers:
            line += f"  follows {followers[name].driver}"
        lines.append(line)
    return lines


def _pads(hand: HandModel) -> list[str]:
    T_hp = hand.pad_transforms(placement.neutral(hand.model))
    width = max(len(name) for name in hand.pad_names)
    lines = []
    for k, (pad, box, T) in enumerate(zip(hand.pads, hand.pad_boxes, T_hp, strict=True)):
        (a, b), (x, y, z), n = pad.size * 1e3, T[:3, 3] * 1e3, T[:3, 2]
        lines.append(
            f"  {k:>2} {pad.name:<{width}}  {a:.1f} x {b:.1f} mm  at {x:.0f}, {y:.0f}, {z:.0f} mm  "
            f"normal {n[0]:+.2f}, {n[1]:+.2f}, {n[2]:+.2f}  on {hand.model.body(box.body).name}"
        )
    return lines


def _notes(hand: HandModel) -> list[str]:
    notes = []
    for a, b in closed_chains(hand.model):
        notes.append(
            f"the file closes a chain between {a} and {b}; such constraints are not solved, so messages must "
            "hold the angles of all joints in it, the passive ones too"
        )
    if order := numbered_out_of_order(hand.joint_names):
        notes.append(order)
    model = hand.model
    if any(model.geom_type[i] == mujoco.mjtGeom.mjGEOM_PLANE for i in range(model.ngeom)):
        notes.append(
            "the file has a floor (a plane), as a scene has; where there is a file of the hand alone, "
            "take that one"
        )
    if model.ngeom == 0:
        notes.append(
            "the hand has no shapes, so no picture shows its links and no pad's place is checked"
        )
    return notes


def _size_problems(hand: HandModel) -> list[str]:
    places = hand.pad_transforms(placement.neutral(hand.model))[:, :3, 3]
    longest = float(np.ptp(np.vstack([places, np.zeros(3)]), axis=0).max())
    if longest > LONGEST:
        return [
            f"the pads are {longest:.4g} m apart: is the file in millimetres? It has to be in metres"
        ]
    if longest < SHORTEST and len(hand.pads) > 2:
        return [f"the pads are only {longest * 1e3:.2g} mm apart: is the file in metres?"]
    return []
