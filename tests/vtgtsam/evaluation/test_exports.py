# SPDX-License-Identifier: MIT
import dataclasses
from pathlib import Path

import gtsam
import numpy as np
import pandas as pd
import pytest
from held_box import write_grasp

from vtgtsam import evaluate, read_recording
from vtgtsam.estimate import Estimate
from vtgtsam.evaluation.bop import bop_lines
from vtgtsam.evaluation.estimates import estimates_table
from vtgtsam.evaluation.tum import tum_lines

METHODS = ("vis", "vis+tac+pen")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("exports")
    write_grasp(folder / "in" / "b.mcap", seed=0, frames=5, object="mug")
    write_grasp(folder / "in" / "a.mcap", seed=1, frames=6, object="can")
    write_grasp(folder / "in" / "c.mcap", seed=2, frames=4, object="can", camera=False)
    evaluate(folder / "in", METHODS, "tuned", folder / "out")
    return folder


def poses_of(folder: Path, sequence: str, method: str) -> list[gtsam.Pose3]:
    table = pd.read_parquet(folder / "out" / "estimates" / f"{sequence}.parquet")
    return [
        gtsam.Pose3(gtsam.Rot3.Quaternion(r.qw, r.qx, r.qy, r.qz), np.array([r.x, r.y, r.z]))
        for r in table[table["method"] == method].itertuples()
    ]


def test_bop_has_poses_in_the_camera_frame_in_mm(folder):
    table = pd.read_csv(folder / "out" / "bop" / "vis+tac+pen.csv")
    assert list(table.columns) == ["scene_id", "im_id", "obj_id", "score", "R", "t", "time"]
    T_wc = read_recording(folder / "in" / "b.mcap").camera_pose
    rows = table[table["scene_id"] == 2]
    for row, T_wo in zip(rows.itertuples(), poses_of(folder, "b", "vis+tac+pen"), strict=True):
        T_co = np.linalg.inv(T_wc.matrix()) @ T_wo.matrix()
        R, t_mm = np.fromstring(row.R, sep=" "), np.fromstring(row.t, sep=" ")
        np.testing.assert_allclose(R.reshape(3, 3), T_co[:3, :3], atol=1e-12)
        np.testing.assert_allclose(t_mm, 1e3 * T_co[:3, 3], atol=1e-9)
    assert rows["im_id"].tolist() == list(range(5))
    assert set(table["time"]) == {-1}


def test_bop_numbers_are_explained(folder):
    scenes = pd.read_csv(folder / "out" / "bop" / "scenes.csv")
    assert scenes.values.tolist() == [
        [1, "a", 1, "can"],
        [2, "b", 2, "mug"],
    ]  # c has no camera pose


@pytest.mark.parametrize("method", METHODS)
def test_tum_lines_are_seconds_metres_and_xyzw(folder, method):
    table = np.loadtxt(folder / "out" / "tum" / method / "a.txt")
    recording = read_recording(folder / "in" / "a.mcap")
    np.testing.assert_allclose(table[:, 0], [m.time for m in recording.measurements()], atol=1e-9)
    for row, T_wo in zip(table, poses_of(folder, "a", method), strict=True):
        np.testing.assert_array_equal(row[1:4], T_wo.translation())
        quat_wxyz = row[[7, 4, 5, 6]]
        assert gtsam.Rot3.Quaternion(*quat_wxyz).equals(T_wo.rotation(), 1e-12)


def test_a_camera_that_moves_is_where_it_was_last_seen():
    moved = np.eye(4)
    moved[0, 3] = 0.5
    row = {"x": 1.0, "y": 0.0, "z": 0.0, "qx": 0.0, "qy": 0.0, "qz": 0.0, "qw": 1.0}
    rows = [row | {"time": time} for time in (0.5, 1.0, 1.9, 2.0)]
    lines = bop_lines(1, 1, [(1.0, np.eye(4)), (2.0, moved)], rows)
    found = [(line.split(",")[1], float(line.split(",")[5].split()[0])) for line in lines]
    assert found == [("1", 1000.0), ("2", 1000.0), ("3", 500.0)]  # not known yet at 0.5 s


def test_frames_without_a_pose_are_left_out_and_keep_their_number():
    nothing = Estimate(
        time=1.0,
        T_wo=None,
        covariance=np.full((6, 6), np.inf),
        status="waiting",
        faults=(),
        mode=None,
        events=(),
        iterations=0,
        error=np.nan,
        visual_weight=0.0,
        pad_distances=np.full(2, np.nan),
        pad_weights=np.zeros(2),
        contact_points_w=np.full((2, 3), np.nan),
    )
    found = dataclasses.replace(nothing, time=1.5, T_wo=gtsam.Pose3(), status="ok")
    table = estimates_table({"vis": [nothing, found]}, [np.array([True, False])] * 2)
    rows = table.to_pylist()
    assert rows[0]["x"] is None
    assert rows[0]["status"] == "waiting"
    assert rows[1]["time_rel"] == 0.5
    assert [line.split(",")[:3] for line in bop_lines(4, 5, [(0.0, np.eye(4))], rows)] == [
        ["4", "1", "5"]
    ]
    assert tum_lines(rows)[1:] == ["1.500000000 0.0 0.0 0.0 0.0 0.0 0.0 1.0\n"]
