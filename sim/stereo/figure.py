# SPDX-License-Identifier: MIT
"""The figure of the documentation: what a stereo camera makes of a hand (``python -m sim.stereo.figure``)."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from ..camera import MAX_RANGE, DepthCamera
from ..observe import camera_pose, window
from ..replay import Replay
from ..sequence import SequenceName, Settings, make_trajectory
from . import rig
from .infrared import InfraredCamera
from .matching import Matcher, depth_of
from .video import exposed, surrounding

ERROR = 0.02  # [m], the largest that has a colour of its own


def columns(object_name: str, seed: int) -> list[tuple[np.ndarray, ...]]:
    """Infrared image, true depth, measured depth and error at the start, in the grasp and after the turn."""
    world, trajectory = make_trajectory(Settings("vary", seed), SequenceName(object_name, 0))
    T_wc = camera_pose(world)
    camera = window(world, T_wc, rig.INFRARED)
    matched, inner = surrounding(camera)
    replay, exact = Replay(world.model, world.hand.joint_names), DepthCamera(world.model, camera)
    imagers = [InfraredCamera(world.model, matched, x) for x in (0.0, rig.BASELINE)]
    rng, matcher = np.random.default_rng(seed), Matcher()
    found: list[tuple[np.ndarray, ...]] = []
    for k in (0, int(np.searchsorted(trajectory.frame_time, 4.0)), -1):
        replay.show(trajectory.frame_joints[k], trajectory.frame_T_wh[k], trajectory.frame_T_wo[k])
        true, _ = exact.render(replay.data, T_wc)
        pair = np.stack([imager.render(replay.data, T_wc) for imager in imagers])
        left, right = exposed(pair, rng, 1.0)
        measured = depth_of(matcher.disparity(left, right)[inner], camera.fx, MAX_RANGE)
        known = (true > 0.0) & (measured > 0.0)
        found.append((left[inner], true, measured, np.where(known, measured - true, np.nan)))
    return found


def draw(found: list[tuple[np.ndarray, ...]], out: Path) -> None:
    """Write the images as a figure, an instant a row."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(len(found), 4, figsize=(9.0, 3.1 * len(found)))
    for row, images in zip(axes, found, strict=True):
        seen = images[1][images[1] > 0.0]
        near, far = float(seen.min()) - 0.02, float(seen.max()) + 0.05
        row[0].imshow(images[0], cmap="gray", vmin=0, vmax=255)
        for axis, depth in zip(row[1:3], images[1:3], strict=True):
            shown = axis.imshow(np.where(depth > 0.0, depth, np.nan), vmin=near, vmax=far)
        figure.colorbar(shown, ax=row[2], label="depth [m]", shrink=0.8)
        off = row[3].imshow(1e3 * images[3], cmap="RdBu", vmin=-1e3 * ERROR, vmax=1e3 * ERROR)
        figure.colorbar(off, ax=row[3], label="error [mm]", shrink=0.8)
    for axis, title in zip(
        axes[0], ("left infrared image", "true", "measured", "error"), strict=True
    ):
        axis.set_title(title)
    for axis in axes.ravel():
        axis.set_xticks([])
        axis.set_yticks([])
        axis.set_facecolor("0.85")
    figure.tight_layout()
    figure.savefig(out, dpi=90)


def main() -> None:
    """Draw it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--object", default="can")
    parser.add_argument("--seed", type=int, default=21)
    given = parser.parse_args()
    draw(columns(given.object, given.seed), given.out)
    print(f"wrote {given.out}")


if __name__ == "__main__":
    main()
