# SPDX-License-Identifier: MIT
"""A tracker by itself next to the same one that is handed poses."""

import numpy as np
import pytest
from held_box import write_grasp

from benchmarks.hand_back import METHODS, Judged, judged, paired, rows
from vtgtsam.evaluation.phases import AFTER, BEFORE
from vtgtsam.exceptions import RecordingError


def grasp(error_mm, seen=1.0):
    """Ten frames a phase of one error."""
    errors = {method: np.full(10, error_mm) for method in METHODS}
    return {phase: Judged(seen, errors) for phase in (BEFORE, AFTER)}


def test_a_recording_has_its_tracker_and_errors_of_both_phases(tmp_path):
    write_grasp(tmp_path / "grasp.mcap", frames=400)
    name, _, phases = judged(tmp_path / "grasp.mcap")
    assert name == "grasp"
    assert set(phases) == {BEFORE, AFTER}
    for phase in phases.values():
        assert 0.0 < phase.seen <= 1.0
        assert all(np.isfinite(phase.errors_mm[method]).all() for method in METHODS)


def test_grasps_are_paired_by_name_and_judged_side_by_side():
    found = [
        ("mug", "depth-hand+back", grasp(2.0)),
        ("can", "depth-hand", grasp(1.0)),
        ("mug", "depth-hand", grasp(9.0, seen=0.5)),
        ("can", "depth-hand+back", grasp(1.0)),
    ]
    made = rows(paired(found))
    assert len(made) == 8  # two phases, methods and trackers
    alone, told = [row for row in made if row["when"] == AFTER and row["method"] == "vis"]
    assert (alone["largest [mm]"], told["largest [mm]"]) == (9.0, 2.0)
    assert (alone["above 5 mm [%]"], told["above 5 mm [%]"]) == (50.0, 0.0)
    assert (alone["with a visual pose [%]"], told["with a visual pose [%]"]) == (75.0, 100.0)


def test_a_grasp_of_one_tracker_only_is_named():
    with pytest.raises(RecordingError, match="only one of the two for mug"):
        paired(
            [
                ("mug", "depth-hand", grasp(1.0)),
                ("can", "depth-hand", grasp(1.0)),
                ("can", "depth-hand+back", grasp(1.0)),
            ]
        )
    with pytest.raises(RecordingError, match="no recording"):
        paired([])
