# SPDX-License-Identifier: MIT
import numpy as np
import pandas as pd
import pytest
import scipy.stats
from made_results import write_results

from benchmarks.claims import claims
from vtgtsam.evaluation.tables import make_tables


def test_claims_are_the_medians_and_tests_of_the_stored_sequences(tmp_path):
    out = write_results(tmp_path / "results")
    make_tables(out)
    rows = {row["phase"]: row for row in claims("made", out)}
    metrics = pd.read_csv(out / "per_sequence.csv").query("phase == 'after'")
    errors = metrics.pivot(index="sequence", columns="method", values="adds_median_mm")
    after = rows["after"]
    assert after["vis+tac+pen [mm]"] == pytest.approx(errors["vis+tac+pen"].median())
    difference = errors["vis"] - errors["vis+tac+pen"]
    assert after["better than vis"] == f"{(difference > 0).sum()} of {len(difference)}"
    p = scipy.stats.wilcoxon(difference).pvalue
    assert float(after["p against vis"]) == pytest.approx(p, rel=0.5)  # of one digit
    assert set(rows) == {"before", "after"} and np.isfinite(rows["before"]["vis [mm]"])
