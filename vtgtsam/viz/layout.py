# SPDX-License-Identifier: MIT
"""How the viewer arranges a scene: the hand large on the left, plots and status on the right."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import rerun.blueprint as rrb

from . import names
from .scene import pose_path, uncertainty_path

DISTANCE = 0.42  # [m], from the eye to what it looks at: hand and object fill the view
BACKGROUND = (52, 56, 64)  # hands are often black


@dataclass(frozen=True, eq=False)
class Eye:
    """From where the three-dimensional view begins.

    Attributes:
        target: What it looks at, world frame [m], shape (3,).
        position: Where it stands, world frame [m], shape (3,).
    """

    target: np.ndarray
    position: np.ndarray

    @classmethod
    def beside(cls, target: np.ndarray, camera: np.ndarray, up: np.ndarray) -> Eye:
        """An eye that looks at ``target`` from beside and above a camera, all in the world frame [m].

        Args:
            target: What to look at, shape (3,).
            camera: Where the camera stands, shape (3,); any place that is not ``target``.
            up: Direction of up, shape (3,).
        """
        away = (camera - target) / np.linalg.norm(camera - target)
        direction = away + 0.6 * np.cross(away, up) + 0.2 * up
        return cls(target, target + DISTANCE * direction / np.linalg.norm(direction))


def layout(
    hidden: Iterable[str] = (),
    eye: Eye | None = None,
    images: Iterable[str] = (),
    live: bool = False,
    truth: bool = True,
) -> rrb.Blueprint:
    """The arrangement.

    Args:
        hidden: Methods whose object is not drawn at first; a click shows it.
        eye: From where to look; None: from where all is seen.
        images: Images that there are: "color", "depth".
        live: Whether it is a live run, with a text on how its streams are.
        truth: Whether there are true poses, and so errors.
    """
    views: list[rrb.Container | rrb.View] = [_space(hidden, eye)]
    pictures = [_picture(image) for image in images]
    if pictures:
        views.append(rrb.Horizontal(*pictures))
    left = rrb.Vertical(*views, row_shares=[3, 1] if pictures else [1])
    plots = _plots(truth)
    log = rrb.TextLogView(origin=names.LOG, name="status")
    if live:
        streams = rrb.TextDocumentView(origin=names.WORDS, name="estimate and streams")
        shares = [4, *[2] * len(plots), 2]
        right = rrb.Vertical(streams, *plots, log, row_shares=shares)
    else:
        right = rrb.Vertical(*plots, log)
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=[3, 2]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=names.TIME),
    )


def _space(hidden: Iterable[str], eye: Eye | None) -> rrb.Spatial3DView:
    invisible = rrb.EntityBehavior(visible=False)
    return rrb.Spatial3DView(
        origin=names.WORLD,
        name="hand and object",
        overrides={
            path(name): invisible for name in hidden for path in (pose_path, uncertainty_path)
        },
        eye_controls=None
        if eye is None
        else rrb.EyeControls3D(position=eye.position, look_target=eye.target),
        background=rrb.Background(color=BACKGROUND),
        line_grid=False,
    )


def _picture(image: str) -> rrb.Spatial2DView:
    return rrb.Spatial2DView(origin=f"{names.WORLD}/camera/{image}", name=f"camera: {image}")


def _plots(truth: bool) -> list[rrb.TimeSeriesView]:
    titles = {
        names.ADDS: "ADD-S [mm]",
        names.PAD_DISTANCE: "pads in contact: distance to the object [mm]",
        names.VISUAL_RESIDUAL: "distance from the visual pose [mm]",
        names.WEIGHT: "weight of the visual pose",
    }
    return [
        rrb.TimeSeriesView(origin=f"plots/{quantity}", name=title)
        for quantity, title in titles.items()
        if truth or quantity != names.ADDS
    ]
