# SPDX-License-Identifier: MIT
"""What one sample is."""

import numpy as np
import pandas as pd
import pytest

from vtgtsam.evaluation.units import samples, samples_alone


@pytest.mark.parametrize(("dataset", "count"), [("vary", 39), ("occ", 3)])
def test_a_method_alone_has_the_samples_of_its_column(dataset, count):
    rng = np.random.default_rng(0)
    table = pd.DataFrame(
        {
            "dataset": dataset,
            "object": np.tile(["can", "mug", "box"], 14)[:40],
            "sequence": [f"s_{k:02d}" for k in rng.permutation(40)],
            "method": "vis",
            "value": rng.normal(size=40),
        }
    )
    table.loc[7, "value"] = np.nan
    found = samples_alone(table, "value")
    assert len(found) == count
    np.testing.assert_array_equal(found, samples(table, "value")["vis"].to_numpy())
