# SPDX-License-Identifier: MIT
import numpy as np
import pandas as pd
import pytest
import scipy.stats

from vtgtsam.evaluation.significance import holm, noise_tests, paired_tests, signed_rank


def statistics(
    errors: dict[str, list[float]], dataset: str = "vary", runs: int = 1
) -> pd.DataFrame:
    """Per-sequence rows: each method's median ADD-S [m], `runs` sequences an object."""
    return pd.DataFrame(
        [
            {
                "dataset": dataset,
                "tracker": "depth",
                "noise_scale": "1",
                "object": f"object_{i // runs}",
                "sequence": f"sequence_{i}",
                "method": method,
                "phase": "all",
                "adds_median_m": value,
            }
            for method, values in errors.items()
            for i, value in enumerate(values)
        ]
    )


def test_for_all(tests: pd.DataFrame) -> pd.DataFrame:
    return tests[tests["phase"] == "all"].set_index("comparison")


test_for_all.__test__ = False


def test_p_statistic_and_direction_agree_with_scipy():
    rng = np.random.default_rng(0)
    vis, fused = rng.uniform(1e-3, 9e-3, 30), rng.uniform(1e-3, 6e-3, 30)
    test = test_for_all(paired_tests(statistics({"vis": vis, "vis+pen": fused}))).loc[
        "vis+pen vs vis"
    ]
    expected = scipy.stats.wilcoxon(fused, vis)
    assert test["p"] == pytest.approx(expected.pvalue, rel=1e-12)
    assert test["statistic"] == expected.statistic
    assert test["n"] == 30
    assert test["n_better"] == int((fused < vis).sum())
    assert test["unit"] == "sequence"


def test_a_tracker_that_was_handed_fused_poses_back_takes_part_in_no_comparison():
    rng = np.random.default_rng(0)
    errors = {"vis": rng.uniform(1e-3, 9e-3, 30), "vis+tac+pen": rng.uniform(1e-3, 3e-3, 30)}
    table = statistics(errors)
    handed_back = table.assign(tracker="depth-hand+back")
    after = handed_back.assign(phase="after")
    for tests in (
        paired_tests(handed_back).query("phase == 'all'"),
        noise_tests(pd.concat([after, after.assign(noise_scale="2")])).query("phase == 'after'"),
    ):
        assert len(tests) and tests["p"].isna().all()
        assert tests["note"].str.contains("handed fused poses back").all()
    both = paired_tests(pd.concat([table, handed_back]))
    alone = paired_tests(table)
    pd.testing.assert_frame_equal(both[both["tracker"] == "depth"].reset_index(drop=True), alone)


def test_effect_size_is_the_share_of_favourable_minus_unfavourable_ranks():
    # ranks 1..4; the smallest difference speaks against the first method: (2 + 3 + 4 - 1) / 10
    assert signed_rank(np.array([-0.1, 0.2, 0.3, 0.4]))["effect_size"] == pytest.approx(0.8)
    assert signed_rank(np.array([0.1, -0.2, -0.3, -0.4]))["effect_size"] == pytest.approx(-0.8)


def test_what_rounding_leaves_of_a_difference_is_none():
    """Two methods that do the same, to 6e-15 mm: nothing to test, and nobody is better."""
    vis = np.linspace(1e-3, 4e-3, 8)
    for off in (6e-18, -6e-18, 0.9e-9):
        errors = {"vis": vis, "vis+pen": vis - off}
        test = test_for_all(paired_tests(statistics(errors))).loc["vis+pen vs vis"]
        assert np.isnan(test["p"])
        assert test["n_better"] == 0
        assert test["difference_mm"] == 0.0
        assert test["note"].startswith("all 8 pairs equal: nothing to test")


def test_differences_that_are_equal_but_for_rounding_share_their_rank():
    exact = np.array([1, 1, 1, 1, -1, 2, 2, -3]) * 1e-3
    rounded = exact * (1 + 1e-13 * np.array([3, -1, 2, 0, -5, 1, -4, 2]))
    assert signed_rank(rounded) == signed_rank(exact)
    assert signed_rank(exact)["p"] == pytest.approx(scipy.stats.wilcoxon(1e3 * exact).pvalue)
    # The ranks as they are would differ, and p with them.
    assert scipy.stats.wilcoxon(rounded).pvalue != scipy.stats.wilcoxon(exact).pvalue


def test_infinite_differences_stay_infinite():
    result = signed_rank(np.array([np.inf, 1e-3, 2e-3, -1e-3, 3e-3, 4e-3, 0.0]))
    assert result["note"] == "1 of 7 pairs equal, left out"
    assert 0 < result["p"] < 1


def test_holm_agrees_with_statsmodels():
    multitest = pytest.importorskip("statsmodels.stats.multitest")
    p = np.array([0.04, 0.001, 0.04, 0.9, 0.03, 0.012])
    np.testing.assert_allclose(holm(p), multitest.multipletests(p, method="holm")[1], rtol=1e-12)


def test_holm_spans_all_comparisons_of_a_condition():
    rng = np.random.default_rng(1)
    errors = {m: rng.uniform(0, s, 12) for m, s in (("vis", 9), ("vis+pen", 6), ("x", 3))}
    tests = paired_tests(statistics(errors))
    tested = tests.dropna(subset="p")
    assert len(tested) == 3
    np.testing.assert_allclose(tested["p_holm"], holm(tested["p"].to_numpy()))


def test_conditions_are_tested_apart():
    errors = {"vis": np.arange(2.0, 10.0), "vis+pen": np.arange(1.0, 9.0)}
    one = statistics(errors)
    two = one.assign(tracker="depth-hand")
    tests = paired_tests(pd.concat([one, two]))
    together = tests[tests["phase"] == "all"]
    assert together["tracker"].tolist() == ["depth", "depth-hand"]
    assert together["n"].tolist() == [8, 8]


def test_runs_of_one_object_are_averaged_in_dataset_occ():
    vis = [1.0, 3.0, 2.0, 2.0, 4.0, 3.0, 1.0, 1.0, 1.0]  # by object: means 2, 3, 1
    fused = [5.0, 0.0, 0.0, 1.0, 1.0, 1.0, 9.0, 0.5, 0.5]  # means 5/3, 1, 10/3
    test = test_for_all(
        paired_tests(statistics({"vis": vis, "fused": fused}, dataset="occ", runs=3))
    ).loc["fused vs vis"]
    assert (test["unit"], test["n"], test["n_better"]) == ("object", 3, 2)
    assert test["p"] == scipy.stats.wilcoxon([1 / 3, 2.0, -7 / 3]).pvalue
    assert test["effect_size"] == pytest.approx((1 + 2 - 3) / 6)


def test_equal_pairs_are_said_in_words():
    test = test_for_all(paired_tests(statistics({"vis": [1.0] * 8, "vis+pen": [1.0] * 8})))
    row = test.loc["vis+pen vs vis"]
    assert row["note"] == "all 8 pairs equal: nothing to test"
    assert row["effect_size"] == 0.0
    assert pd.isna(row["p"])


def test_some_equal_pairs_are_left_out_and_counted():
    result = signed_rank(np.array([0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))
    assert result["p"] == scipy.stats.wilcoxon(np.arange(1.0, 7.0)).pvalue
    assert result["note"] == "2 of 8 pairs equal, left out"


def test_too_few_pairs_are_said_in_words():
    result = signed_rank(np.array([1.0, 2.0, 3.0, 4.0, 5.0]))
    assert result["p"] == 0.0625
    assert "5 differ, 6 needed" in result["note"]


def test_a_sequence_without_a_pose_counts_as_the_worst_not_as_missing():
    errors = {"vis": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], "vis+pen": [np.inf] + [0.5] * 6}
    row = test_for_all(paired_tests(statistics(errors))).loc["vis+pen vs vis"]
    assert (row["n"], row["n_better"]) == (7, 6)
    assert row["effect_size"] == pytest.approx((1 + 2 + 3 + 4 + 5 + 6 - 7) / 28)


def test_two_sequences_without_a_pose_are_equal():
    errors = {"vis": [np.inf, 2.0], "vis+pen": [np.inf, 1.0]}
    row = test_for_all(paired_tests(statistics(errors))).loc["vis+pen vs vis"]
    assert "1 of 2 pairs equal" in row["note"]


def test_a_phase_without_sequences_is_said_in_words():
    tests = paired_tests(statistics({"vis": [1.0] * 7, "vis+pen": [0.5] * 7}))
    after = tests[tests["phase"] == "after"].iloc[0]
    assert after["n"] == 0
    assert after["note"] == "no pairs: nothing to test"
