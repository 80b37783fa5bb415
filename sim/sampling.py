# SPDX-License-Identifier: MIT
"""Sequences for the datasets: sample start poses until a grasp holds, and count why others did not."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vtgtsam.exceptions import VtgtsamError

from . import placement
from .power_grasp import power_grasp
from .simulate import Rejected, Trajectory, simulate
from .world import World

DATASETS = ("vary", "occ")
TRIES = 60  # samples after which an object counts as not graspable


class NotGraspable(VtgtsamError):
    """No sample of an object was accepted; the message counts the reasons.

    Attributes:
        rejections: How often each reason occurred.
    """

    def __init__(self, message: str, rejections: Counter[str] | None = None) -> None:
        super().__init__(message)
        self.rejections = rejections or Counter()


@dataclass(frozen=True)
class Sequence:
    """An accepted sequence.

    Attributes:
        trajectory: What truly happened.
        rejections: Reasons of the samples rejected before it, in their order.
    """

    trajectory: Trajectory
    rejections: tuple[str, ...]


def sample_sequence(
    world: World, dataset: str, rng: np.random.Generator, event: str | None = None
) -> Sequence:
    """The first accepted sequence of a random stream.

    Args:
        world: Hand and object.
        dataset: "vary" or "occ".
        rng: The only source of randomness: the same state gives the same bytes.
        event: What happens to the grasp once it holds, one of ``events.EVENTS``; None: nothing.

    Raises:
        NotGraspable: None of ``TRIES`` samples was accepted.
    """
    if dataset not in DATASETS:
        raise ValueError(f"dataset must be one of {', '.join(DATASETS)}, got {dataset!r}")
    start_pose = _sampler(world, dataset, rng)
    rejections: list[str] = []
    for _ in range(TRIES):
        try:
            return Sequence(simulate(world, start_pose(), event), tuple(rejections))
        except Rejected as reason:
            rejections.append(str(reason))
    counts = ", ".join(f"{n} x {reason}" for reason, n in Counter(rejections).most_common())
    raise NotGraspable(
        f"{world.hand.name} cannot grasp {world.obj.name}: {counts}", Counter(rejections)
    )


def _sampler(world: World, dataset: str, rng: np.random.Generator) -> Callable[[], np.ndarray]:
    mesh = world.obj.mesh
    if dataset == "vary":
        return lambda: placement.vary(world.description, mesh, rng)
    rest = power_grasp(world)
    if rest is None:
        raise NotGraspable(f"no power grasp found for {world.obj.name} in {world.hand.name}")
    return lambda: placement.occ(rest, mesh, rng)
