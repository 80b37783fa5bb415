# SPDX-License-Identifier: MIT
import numpy as np
import pandas as pd
import pytest
import scipy.stats
from made_results import write_results

from vtgtsam.evaluation.bootstrap import median_interval
from vtgtsam.evaluation.significance import paired_tests, time_tests
from vtgtsam.evaluation.statistics import auc, sequence_statistics
from vtgtsam.evaluation.steps import step_statistics, turn_times
from vtgtsam.evaluation.tables import make_tables


def frames(times, adds_m, phase="before", method="vis"):
    times = np.asarray(times, dtype=float)
    return pd.DataFrame(
        {
            "sequence": "s0",
            "object": "can",
            "dataset": "vary",
            "method": method,
            "time_rel": times,
            "adds_m": np.broadcast_to(np.asarray(adds_m, dtype=float), times.shape),
            "add_m": 0.0,
            "translation_m": 0.0,
            "rotation_rad": 0.0,
            "status": "ok",
            "phase": phase,
        }
    )


def test_a_step_is_half_a_second_and_begins_with_its_first_instant():
    steps = step_statistics(frames([0.0, 0.499, 0.5, 0.999, 1.0], [1, 3, 5, 7, 9]))
    assert steps["step"].tolist() == [0, 1, 2]
    assert steps["adds_median_m"].tolist() == [2, 6, 9]


def test_a_step_whose_frames_have_no_pose_is_infinitely_wrong():
    steps = step_statistics(frames([0.1, 0.2, 0.3, 0.6], [np.nan, np.nan, 1.0, 1.0]))
    assert steps["adds_median_m"].tolist() == [np.inf, 1.0]


def test_steps_are_those_of_each_method():
    table = pd.concat([frames([0.1, 0.2], 1.0), frames([0.1, 0.2], 2.0, method="vis+pen")])
    steps = step_statistics(table)
    assert dict(zip(steps["method"], steps["adds_median_m"], strict=True)) == {
        "vis": 1.0,
        "vis+pen": 2.0,
    }


def test_the_turn_is_told_by_its_first_and_last_frame():
    times = [0.0, 1.0, 2.0, 3.0]
    assert turn_times(frames(times, 1.0, ["before", "turning", "turning", "after"])) == (1.0, 2.0)
    assert np.isnan(turn_times(frames(times, 1.0))).all()


def test_auc_is_the_area_under_the_accuracy_threshold_curve():
    errors = np.random.default_rng(0).uniform(0, 0.15, 50)
    thresholds = (np.arange(200_000) + 0.5) / 200_000 * 0.1
    accuracy = np.searchsorted(np.sort(errors), thresholds) / len(errors)
    assert auc(errors) == pytest.approx(accuracy.mean(), abs=1e-5)  # 0.5 / 200 000 a sample


def test_auc_of_perfect_and_of_missing_poses():
    assert auc(np.zeros(3)) == 1.0
    assert auc(np.array([0.1, 5.0, np.inf])) == 0.0


def test_shares_and_auc_of_a_sequence():
    (row, _) = sequence_statistics(frames([0, 1, 2, 3], [0.004, 0.009, 0.010, np.nan]))
    assert row["frames_below_5mm"] == 1
    assert row["frames_below_10mm"] == 2
    assert row["auc_10cm"] == pytest.approx((0.96 + 0.91 + 0.9 + 0) / 4)


def test_the_interval_is_the_bootstraps_and_the_same_every_time():
    values = np.random.default_rng(1).lognormal(0, 1, 40)
    low, high = median_interval(values)
    again = np.random.default_rng(2)
    medians = [np.median(again.choice(values, len(values))) for _ in range(20_000)]
    expected = np.quantile(medians, [0.025, 0.975])
    # Two bootstraps differ by their draws; the ends lie on samples, neighbours 3 % apart.
    np.testing.assert_allclose([low, high], expected, rtol=0.06)
    assert median_interval(values) == (low, high)


def test_the_interval_covers_the_true_median_as_often_as_it_says():
    rng = np.random.default_rng(3)
    found = [median_interval(rng.normal(size=25)) for _ in range(150)]
    covered = sum(low <= 0 <= high for low, high in found)
    # Percentile intervals of a median cover about 94 %; 4 sigma of 150 draws are 8 %.
    assert covered / 150 > 0.86


def test_five_samples_have_no_interval_and_infinite_ones_are_no_nan():
    assert median_interval(np.arange(5.0)) is None
    low, high = median_interval(np.array([1.0, 2.0, 3.0, np.inf, np.inf, np.inf, np.inf]))
    assert low < np.inf
    assert high == np.inf


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    out = write_results(tmp_path_factory.mktemp("r"), ("occ", "vary"), objects=list("abcdef"))
    return make_tables(out)


def test_the_summary_counts_the_same_samples_as_the_tests(tables):
    pooled = tables.summary.query("object == 'all' and phase == 'after' and method == 'vis'")
    samples = pooled.set_index("dataset")["samples"]
    assert (samples["occ"], samples["vary"]) == (6, 12)
    after = tables.collected.phases.query("dataset == 'occ' and phase == 'after'")
    means = after[after["method"] == "vis"].groupby("object")["adds_median_m"].mean()
    row = pooled[pooled["dataset"] == "occ"].iloc[0]
    assert row["adds_median_mm"] == pytest.approx(1e3 * means.median())
    assert (row["adds_median_low_mm"], row["adds_median_high_mm"]) == pytest.approx(
        median_interval(1e3 * means.to_numpy())
    )


def test_one_object_alone_has_too_few_sequences_for_an_interval(tables):
    row = tables.summary.query("object == 'a'").iloc[0]
    assert row["sequences"] == 2
    assert np.isnan(row["adds_median_low_mm"])


def test_over_time_has_the_quartiles_of_each_step(tables):
    steps = tables.collected.steps.query("dataset == 'vary' and method == 'vis' and step == 4")
    adds = 1e3 * steps["adds_median_m"].to_numpy(dtype=float)
    (row,) = tables.over_time.query(
        "dataset == 'vary' and object == 'all' and method == 'vis' and time_start_s == 2.0"
    ).to_dict("records")
    found = [row[f"adds_{name}_mm"] for name in ("q25", "median", "q75")]
    np.testing.assert_allclose(found, np.quantile(adds, [0.25, 0.5, 0.75]))
    assert (row["time_end_s"], row["samples"]) == (2.5, 12)


def test_a_sequence_with_one_method_only_is_left_out_in_words(tables):
    rows = tables.collected.phases.query("dataset == 'vary'")
    gone = (rows["sequence"] == rows["sequence"].iloc[-1]) & (rows["method"] == "vis")
    tests = paired_tests(rows[~gone]).query("comparison == 'vis+pen vs vis' and phase == 'after'")
    (row,) = tests.to_dict("records")
    assert row["n"] == 11
    assert row["note"] == "1 sequence left out, in which only one of the two has a value"


def test_a_missing_value_is_left_out_in_words_and_never_nan(tables):
    rows = tables.collected.phases.query("dataset == 'vary' and phase == 'after'").copy()
    first = rows.index[rows["method"] == "vis"][0]
    rows.loc[first, "adds_median_m"] = np.nan
    tests = paired_tests(rows).query("comparison == 'vis+pen vs vis' and phase == 'after'")
    (row,) = tests.to_dict("records")
    kept = rows.pivot(index="sequence", columns="method", values="adds_median_m").dropna()
    assert row["p"] == scipy.stats.wilcoxon(kept["vis"], kept["vis+pen"]).pvalue
    assert "1 sequence left out" in row["note"]


def test_too_few_sequences_at_a_time_step_are_said_in_words(tables):
    steps = tables.collected.steps.query("dataset == 'vary' and object == 'a'")
    tests = time_tests(steps)
    assert (tests["n"] == 2).all()
    assert tests["note"].str.contains("too few pairs").all()
