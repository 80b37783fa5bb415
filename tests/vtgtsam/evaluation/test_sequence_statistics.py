# SPDX-License-Identifier: MIT
import numpy as np
import pandas as pd
import pytest

from vtgtsam.evaluation.statistics import quantile, sequence_statistics
from vtgtsam.evaluation.summary import summarise


def metrics(adds_m, phase="before", status="ok", method="vis", sequence="s0", object="can"):
    adds_m = np.asarray(adds_m, dtype=float)
    return pd.DataFrame(
        {
            "sequence": sequence,
            "object": object,
            "dataset": "vary",
            "method": method,
            "adds_m": adds_m,
            "add_m": 2 * adds_m,
            "translation_m": 3 * adds_m,
            "rotation_rad": 4 * adds_m,
            "status": status,
            "phase": phase,
        }
    )


def rows_by_phase(table):
    return {row["phase"]: row for row in sequence_statistics(table)}


def with_condition(rows):
    return pd.DataFrame(rows).assign(tracker="depth", noise_scale="1")


@pytest.mark.parametrize("q", [0.0, 0.25, 0.4, 0.5, 0.75, 1.0])
def test_quantile_of_finite_values_is_numpys(q):
    values = np.random.default_rng(0).normal(size=9)
    assert quantile(values, q) == pytest.approx(np.quantile(values, q), rel=1e-12)


def test_quantiles_with_infinite_values_are_never_nan():
    values = np.array([1.0, 2.0, np.inf, np.inf])
    assert quantile(values, 0.25) == 1.75
    assert quantile(values, 0.5) == np.inf
    assert quantile(values, 1.0) == np.inf


def test_each_phase_has_its_own_row_and_the_turn_itself_counts_in_all():
    table = pd.concat(
        [metrics([1e-3] * 3), metrics([9e-3], "turning"), metrics([6e-3] * 2, "after")]
    )
    rows = rows_by_phase(table)
    assert [rows[phase]["frames"] for phase in ("all", "before", "after")] == [6, 3, 2]
    assert rows["before"]["adds_median_m"] == 1e-3
    assert rows["after"]["adds_median_m"] == 6e-3
    assert rows["all"]["adds_median_m"] == 3.5e-3
    assert rows["all"]["frames_below_5mm"] == 3


def test_frames_below_5_mm_are_those_below_5_mm():
    (row, _) = sequence_statistics(metrics([4.99e-3, 5e-3, 5.01e-3]))
    assert row["frames_below_5mm"] == 1


def test_a_phase_that_did_not_happen_has_no_row():
    assert set(rows_by_phase(metrics([1e-3]))) == {"all", "before"}


def test_frames_without_a_pose_are_failures_not_missing():
    row = rows_by_phase(metrics([1e-3, np.nan, np.nan], status=["ok", "waiting", "waiting"]))["all"]
    assert row["frames"] == 3
    assert row["frames_without_pose"] == 2
    assert row["frames_below_5mm"] == 1
    assert row["adds_median_m"] == np.inf


def test_lost_frames_are_counted_and_keep_their_error():
    row = rows_by_phase(metrics([1e-3, 8e-3, 8e-3], status=["ok", "lost", "unobservable"]))["all"]
    assert row["frames_not_held"] == 2
    assert row["adds_median_m"] == 8e-3


def test_a_stalled_frame_is_not_lost():
    assert rows_by_phase(metrics([1e-3], status="stalled"))["all"]["frames_not_held"] == 0


def test_summary_takes_medians_over_sequences_and_the_share_over_frames():
    rows = [
        *sequence_statistics(metrics([1e-3], sequence="s0")),
        *sequence_statistics(metrics([2e-3], sequence="s1")),
        *sequence_statistics(metrics([9e-3] * 98, sequence="s2")),
    ]
    row = summarise(with_condition(rows)).query("object == 'can' and phase == 'all'").iloc[0]
    assert row["adds_median_mm"] == pytest.approx(2.0)
    assert row["adds_q25_mm"] == pytest.approx(1.5)
    assert row["adds_q75_mm"] == pytest.approx(5.5)
    assert row["add_median_mm"] == pytest.approx(4.0)
    assert row["translation_median_mm"] == pytest.approx(6.0)
    assert row["rotation_median_deg"] == pytest.approx(np.degrees(8e-3))
    assert row["share_below_5mm"] == pytest.approx(0.02)
    assert (row["sequences"], row["frames"]) == (3, 100)


def test_summary_has_all_objects_first_and_methods_as_given():
    rows = [
        row
        for name in ("zebra", "ant")
        for method in ("vis+tac+pen", "vis")
        for row in sequence_statistics(metrics([1e-3], method=method, sequence=name, object=name))
    ]
    summary = summarise(with_condition(rows)).query("phase == 'all'")
    assert list(zip(summary["object"], summary["method"], strict=True)) == [
        (name, method) for name in ("all", "ant", "zebra") for method in ("vis+tac+pen", "vis")
    ]


def test_trackers_are_never_pooled():
    one = with_condition(sequence_statistics(metrics([1e-3])))
    two = with_condition(sequence_statistics(metrics([3e-3]))).assign(tracker="depth-hand")
    summary = summarise(pd.concat([one, two])).query("object == 'all' and phase == 'all'")
    assert dict(zip(summary["tracker"], summary["adds_median_mm"], strict=True)) == {
        "depth": 1.0,
        "depth-hand": 3.0,
    }
