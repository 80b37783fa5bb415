# SPDX-License-Identifier: MIT
"""The numbers in ``tests*.csv``, computed again from ``metrics.parquet`` by other means.

The exact p of the signed-rank test is the share of all 2^n ways to put signs to the ranks whose rank sums
are at least as uneven as the observed ones.
"""

import itertools

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from made_results import write_results

from vtgtsam.evaluation.tables import make_tables


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    objects = [f"object_{i}" for i in range(9)]
    write_results(folder, ("occ", "vary"), ("1", "3"), objects, runs=1, estimates=False)
    make_tables(folder)
    return folder


@pytest.fixture(scope="module")
def out_runs(tmp_path_factory):
    """Dataset `occ` with three runs an object, of which tests count the mean."""
    folder = tmp_path_factory.mktemp("runs")
    write_results(folder, ("occ",), ("1",), [f"object_{i}" for i in range(8)], 3, estimates=False)
    make_tables(folder)
    return folder


def errors(out, of_sequence, method, keep):
    """Median ADD-S [m] of each sequence over the frames to keep."""
    found = {}
    for row in pq.read_table(out / "metrics.parquet").to_pylist():
        if row["method"] == method and of_sequence(row["sequence"]) and keep(row):
            found.setdefault(row["sequence"], []).append(row["adds_m"])
    return {name: float(np.median(values)) for name, values in found.items()}


def exact(differences):
    """Statistic, two-sided p and rank-biserial correlation of differences without ties or zeros."""
    sizes = sorted(abs(d) for d in differences)
    ranks = [sizes.index(abs(d)) + 1 for d in differences]
    total = sum(ranks)
    plus = sum(rank for rank, d in zip(ranks, differences, strict=True) if d > 0)
    smaller = min(plus, total - plus)
    as_uneven = 0
    for signs in itertools.product((0, 1), repeat=len(ranks)):
        up = sum(rank for rank, sign in zip(ranks, signs, strict=True) if sign)
        as_uneven += min(up, total - up) <= smaller
    return smaller, as_uneven / 2 ** len(ranks), (plus - (total - plus)) / total


def stepped_down(p):
    """Holm's correction as he wrote it: the k-th smallest times (m - k + 1), never falling."""
    corrected, largest = {}, 0.0
    for k, (name, value) in enumerate(sorted(p.items(), key=lambda item: item[1])):
        largest = max(largest, min(1.0, value * (len(p) - k)))
        corrected[name] = largest
    return corrected


def in_phase(phase):
    return lambda row: phase in ("all", row["phase"])


def differences(out, of_sequence, comparison, keep, unit=lambda sequence: sequence):
    """By how much the first-named method is better [m], one number a unit."""
    first, second = comparison.split(" vs ")
    a, b = (errors(out, of_sequence, method, keep) for method in (first, second))
    units = {}
    for sequence in a:
        units.setdefault(unit(sequence), []).append(sequence)
    mean = {name: [np.mean([e[s] for s in runs]) for e in (a, b)] for name, runs in units.items()}
    return [worse - better for better, worse in mean.values()]


def check(row, found):
    statistic, p, effect = exact(found)
    assert row["n"] == len(found)
    assert row["n_better"] == sum(d > 0 for d in found)
    assert row["statistic"] == statistic
    assert row["p"] == pytest.approx(p, rel=1e-12)
    assert row["effect_size"] == pytest.approx(effect, rel=1e-12)
    return p


@pytest.mark.parametrize("dataset", ["occ", "vary"])
def test_the_main_tests(out, dataset):
    tests = pd.read_csv(out / "tests.csv").query("dataset == @dataset and noise_scale == 3")
    assert len(tests) == 9
    p = {}
    for row in tests.to_dict("records"):
        found = differences(
            out,
            lambda name: name.startswith(f"{dataset}__noise_3"),
            row["comparison"],
            in_phase(row["phase"]),
        )
        p[row["phase"], row["comparison"]] = check(row, found)
        assert row["difference_mm"] == pytest.approx(1e3 * np.median(found), rel=1e-12)
        assert row["difference_low_mm"] <= row["difference_mm"] <= row["difference_high_mm"]
    corrected = stepped_down(p)
    for row in tests.to_dict("records"):
        assert row["p_holm"] == pytest.approx(corrected[row["phase"], row["comparison"]])


def test_runs_of_an_object_are_averaged_in_occ(out_runs):
    tests = pd.read_csv(out_runs / "tests.csv").query("phase == 'after'")
    for row in tests.to_dict("records"):
        found = differences(
            out_runs,
            lambda name: True,
            row["comparison"],
            in_phase("after"),
            unit=lambda name: name.rsplit("_", 1)[0],
        )
        assert len(found) == 8
        check(row, found)
        assert row["difference_mm"] == pytest.approx(1e3 * np.median(found), rel=1e-12)


def test_the_tests_over_time(out):
    condition = "dataset == 'vary' and noise_scale == 1 and comparison == 'vis+tac+pen vs vis'"
    tests = pd.read_csv(out / "tests_time.csv").query(condition)
    assert tests["time_start_s"].tolist() == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5]
    p = {}
    for row in tests.to_dict("records"):
        start, end = row["time_start_s"], row["time_end_s"]
        found = differences(
            out,
            lambda name: name.startswith("vary__noise_1"),
            row["comparison"],
            lambda frame, start=start, end=end: start <= frame["time_rel"] < end,
        )
        p[start] = check(row, found)
    corrected = stepped_down(p)
    assert tests["p_holm"].tolist() == pytest.approx([corrected[t] for t in tests["time_start_s"]])
    late = tests[tests["time_start_s"] >= 2]
    assert (late["p_holm"] < 0.05).all()


def test_the_tests_over_noise_scales(out):
    tests = pd.read_csv(out / "tests_noise.csv").query("dataset == 'vary' and phase == 'after'")
    assert len(tests) == 6
    p = {}
    for row in tests.to_dict("records"):
        scale = row["noise_scale"]
        found = differences(
            out,
            lambda name, scale=scale: name.startswith(f"vary__noise_{scale}"),
            row["comparison"],
            in_phase("after"),
        )
        p[scale, row["comparison"]] = check(row, found)
    corrected = stepped_down(p)
    for row in tests.to_dict("records"):
        assert row["p_holm"] == pytest.approx(corrected[row["noise_scale"], row["comparison"]])


def test_a_single_noise_scale_has_no_tests_over_scales(out_runs):
    assert pd.read_csv(out_runs / "tests_noise.csv").empty
