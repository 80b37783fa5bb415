# SPDX-License-Identifier: MIT
"""What images are worth, on a grasp whose truth is known."""

import numpy as np
import pytest
from held_box import write_grasp

from benchmarks.images import (
    FUSED,
    INDEPENDENT,
    TRACKER,
    WITHOUT,
    carried,
    judged,
    recordings,
    rows,
)
from benchmarks.replay import load
from vtgtsam.evaluation.phases import AFTER, BEFORE


@pytest.fixture
def path(tmp_path):
    write_grasp(tmp_path / "grasp.mcap", frames=400)
    return tmp_path / "grasp.mcap"


def test_without_images_the_first_pose_goes_with_the_hand(path):
    frames = load(path).frames
    T_ho = frames[0].T_wh.between(frames[0].T_wo_visual)
    for frame in carried(frames)[::50]:
        assert frame.T_wh.between(frame.T_wo_visual).equals(T_ho, 1e-9)
        assert frame.visual_covariance is None


def test_each_method_has_a_row_with_its_errors(path):
    name, camera, methods = judged(path)
    assert name == "grasp"
    assert set(methods) == {TRACKER, WITHOUT, INDEPENDENT, FUSED}
    worse = methods[FUSED]._replace(error_mm={BEFORE: 1.0, AFTER: 9.0})
    better = methods[FUSED]._replace(error_mm={BEFORE: 1.0, AFTER: 1.0})
    control = methods[WITHOUT]._replace(error_mm={BEFORE: 2.0, AFTER: 2.0})
    found = [
        (name, camera, methods | {FUSED: fused, WITHOUT: control})
        for fused in (worse, better, better)
    ]
    assert [row[FUSED] for row in recordings(found)] == [9.0, 1.0, 1.0]
    (row,) = [row for row in rows(found) if row["method"] == FUSED]
    assert (row["n"], row["not worse"], row["worse by"]) == (3, 2, 7.0)
    assert row["ADD-S"] == "1.00 / 1.00"
    assert np.isfinite(methods[FUSED].nees[AFTER])
