# SPDX-License-Identifier: MIT
"""How sure a median is, given the samples at hand."""

from __future__ import annotations

import numpy as np
import scipy.stats

from .statistics import quantile

CONFIDENCE = 0.95
RESAMPLES = 9999  # SciPy's default
# With five samples even their whole range holds the true median in only 1 - 2 / 2^5 = 94 % of all cases.
FEWEST = 6

_AT_ONCE = 2_000_000  # numbers drawn at a time, 16 MB


def median_interval(values: np.ndarray) -> tuple[float, float] | None:
    """95 % bootstrap interval (percentiles) of the median of samples (N,), or None for fewer than six.

    Samples may be infinite, and so may the interval's ends then. The same samples give the same interval.
    """
    if len(values) < FEWEST:
        return None
    with np.errstate(invalid="ignore"):  # the spread of infinite samples, which is not asked for
        drawn = _medians(values)
    tail = (1 - CONFIDENCE) / 2
    return quantile(drawn, tail), quantile(drawn, 1 - tail)


def _medians(values: np.ndarray) -> np.ndarray:
    """Medians of as many samples drawn again with replacement, shape (RESAMPLES,)."""
    result = scipy.stats.bootstrap(
        (values,),
        np.median,
        n_resamples=RESAMPLES,
        batch=max(1, _AT_ONCE // len(values)),
        method="percentile",
        rng=np.random.default_rng(0),
    )
    return np.asarray(result.bootstrap_distribution)
