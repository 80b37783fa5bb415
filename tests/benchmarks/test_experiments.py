# SPDX-License-Identifier: MIT
"""The experiments' parts and tables, on made-up evaluations."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from benchmarks.experiments import CONDITIONS, FIRST, METHODS, Part, simulated_together, summarised

SIZES_MM = dict(zip(METHODS, (4.0, 3.0, 2.0, 1.0), strict=True))


def evaluated(folder, recordings=8, lost=0):
    """A folder of an evaluation in which method m is ``SIZES_MM[m]`` off, growing with the recording."""
    rows = []
    for n in range(recordings):
        for method, size in SIZES_MM.items():
            for k in range(10):
                missing = method == "vis" and n < lost
                off = 1e-3 * size * (1.0 + 0.1 * n)
                rows.append(
                    {
                        "sequence": f"can_{n}",
                        "method": method,
                        "phase": "after" if k else "before",
                        "adds_m": np.nan if missing else off if k else 1.0,
                        "translation_m": 2.0 * off,
                        "rotation_rad": np.deg2rad(size),
                        "nees": 1.0 if k < 9 else 30.0,
                        "nees_dof": 6,
                    }
                )
    folder.mkdir(parents=True)
    pd.DataFrame(rows).to_parquet(folder / "metrics.parquet")


def test_a_row_says_how_far_a_method_is_off_after_the_turn(tmp_path):
    evaluated(tmp_path / "stereo-robot" / "vary" / "robot_0" / "as_it_is")
    rows = {row["method"]: row for row in summarised(tmp_path)}
    assert list(rows) == list(METHODS)
    for method, size in SIZES_MM.items():
        row = rows[method]
        assert row["condition"] == "stereo-robot" and row["robot"] == "as it is"
        assert row["ADD-S median [mm]"] == pytest.approx(1.35 * size)
        assert row["90 % [mm]"] == pytest.approx(1.63 * size)
        assert row["position [mm]"] == pytest.approx(2.7 * size)
        assert row["rotation [deg]"] == pytest.approx(size)
        assert row["in 95 % region"] == "89%"  # 8 of the 9 frames after the turn
    assert rows["vis"]["frames > 5 mm"] == "62.5%"  # 4 (1 + 0.1 n) above 5 from the third on
    assert rows["vis+tac+pen+mem"]["frames > 5 mm"] == "0.0%"
    # All eight are better: 2 / 2^8 is the least p of eight pairs, three tests.
    assert float(rows["vis+pen"]["p against vis (Holm)"]) == pytest.approx(3 * 2 / 2**8, rel=0.1)
    assert rows["vis"]["p against vis (Holm)"] == ""


def test_robots_are_put_together_and_a_frame_without_a_pose_is_infinitely_wrong(tmp_path):
    for robot in (0, 1):
        evaluated(tmp_path / "paper" / "occ" / f"robot_{robot}" / "as_it_is", lost=6)
    vision = next(row for row in summarised(tmp_path) if row["method"] == "vis")
    assert vision["grasps"] == 16
    assert vision["ADD-S median [mm]"] == np.inf
    assert vision["frames > 5 mm"] == "100.0%"


def test_a_perfect_robot_has_no_errors_and_an_imperfect_one_always_its_own(tmp_path):
    perfect, imperfect = (Part(name, "vary", 3, None) for name in ("stereo", "stereo-robot"))
    assert perfect.settings().robot is None
    settings = [imperfect.settings(), imperfect.calibrating()]
    assert {s.robot for s in settings} == {FIRST + 3} and {s.camera for s in settings} == {"stereo"}
    assert settings[0].seed != settings[1].seed
    assert imperfect.calibrating() == Part("stereo-robot", "occ", 3, "ycb").calibrating()
    assert Part("paper-robot", "occ", 0, None).settings().camera == "paper"
    assert {s.friction for s in (*settings, perfect.settings())} == {"dry"}
    assert Part("stereo", "vary", 3, None, "paper").settings().friction == "paper"
    assert perfect.folder(tmp_path) != imperfect.folder(tmp_path)


def test_only_parts_in_which_the_same_happens_are_simulated_together():
    parts = [
        Part(condition, dataset, robot, None, friction)
        for condition in CONDITIONS
        for dataset in ("vary", "occ")
        for robot in (0, 1)
        for friction in ("dry", "paper")
    ]
    groups = simulated_together(parts)
    assert sorted(map(str, parts)) == sorted(str(part) for group in groups for part in group)
    assert len(groups) == 8
    for group in groups:
        happens = {replace(part.settings(), robot=None, camera="paper") for part in group}
        assert len(happens) == 1
