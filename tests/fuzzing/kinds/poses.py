# SPDX-License-Identifier: MIT
"""Files of a tracker's poses."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
from held_box import write_grasp

from vtgtsam.recording.pose_files import PoseFiles

from .kind import Kind, command, library


def _poses(folder: Path) -> list[bytes]:
    write_grasp(folder / "whole.mcap", frames=6)
    tum = "# time x y z qx qy qz qw\n" + "".join(
        f"{1 + 0.033 * k:.6f} 0.1 0.2 0.3 0 0 0 1\n" for k in range(6)
    )
    bop = "scene_id,im_id,obj_id,score,R,t,time\n" + "".join(
        f"1,{k},1,1.0,1 0 0 0 1 0 0 0 1,100 200 300,-1\n" for k in range(6)
    )
    matrix = "1 0 0 0.1\n0 1 0 0.2\n0 0 1 0.3\n0 0 0 1\n"
    return [tum.encode(), bop.encode(), matrix.encode()]


def _use_poses(path: Path, folder: Path, rng: np.random.Generator) -> str:
    poses = path
    if path.name == "000001.txt":
        poses = folder / "matrices"
        poses.mkdir(exist_ok=True)
        for k in range(6):
            (poses / f"{k:06d}.txt").write_text("1 0 0 0\n0 1 0 0\n0 0 1 1\n0 0 0 1\n")
        shutil.copy(path, poses / path.name)
    options = ("--out", folder / "attached.mcap", "--force")
    return library(lambda: PoseFiles.read(poses).poses) or command(
        "attach-vision", folder / "whole.mcap", poses, *options
    )


POSES = Kind(("tum.txt", "bop.csv", "000001.txt"), _poses, _use_poses)
