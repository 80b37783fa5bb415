# SPDX-License-Identifier: MIT
import math

import pytest

from vtgtsam import EstimatorConfig

tuning = pytest.importorskip("benchmarks.tuning")


def test_what_is_searched_for_says_all_that_tuned_sets_of_it():
    config = EstimatorConfig.tuned()
    again = tuning.config_of(tuning.settings_of(config))
    for name in ("w_tac", "w_pen", "log_theta_vis", "log_theta_tac"):
        assert getattr(again, name) == pytest.approx(getattr(config, name))


def test_a_cut_is_where_a_residual_has_lost_all_but_1_over_e_of_its_weight():
    config = tuning.config_of(
        {"tactile": 1e-3, "penetration": 1e-3, "visual_cut": 5.0, "tactile_cut": 3.0}
    )
    assert math.exp(-(3.0**2) / math.exp(config.log_theta_tac)) == pytest.approx(math.exp(-1))
    assert math.exp(-(5.0**2) / math.exp(config.log_theta_vis)) == pytest.approx(math.exp(-1))
