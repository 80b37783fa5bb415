# SPDX-License-Identifier: MIT
import math

import numpy as np
import pytest

from vtgtsam import EstimatorConfig

settings = pytest.importorskip("benchmarks.memory_settings")


def changed(name):
    """What a variant has otherwise than the recommended settings."""
    ours, theirs = EstimatorConfig.tuned().model_dump(), settings.variants()[name].model_dump()
    return {key: theirs[key] for key in ours if ours[key] != theirs[key]}


def test_each_variant_changes_one_setting_to_half_or_double():
    recommended = EstimatorConfig.tuned()
    names = list(settings.variants())
    assert names[0] == settings.RECOMMENDED and changed(names[0]) == {}
    assert all(len(changed(name)) == 1 for name in names[1:])
    assert changed("restart_after, double") == {"restart_after": 2.0 * recommended.restart_after}
    walk = changed("held walk, half")["held"]
    assert walk[:2] == pytest.approx(np.array(recommended.held[:2]) / 2.0)
    assert walk[2] == recommended.held.correlation
    theta = changed("theta_vis_mem, double")["log_theta_vis_mem"]
    assert math.exp(theta) == pytest.approx(2.0 * math.exp(recommended.log_theta_vis_mem))


def test_rows_are_geometric_means_of_folders_beside_the_recommended_settings():
    judged = [settings.Judged(error, 0.1, 0.9, 4.0) for error in (1.0, 4.0, 9.0)]
    found = [{name: j for name in settings.variants()} for j in judged]
    labelled = [("paper", None), ("paper", None), ("stereo", None)]
    row = settings._row("held walk, half", labelled, found)
    assert row["paper"] == pytest.approx(2.0) and row["stereo"] == pytest.approx(9.0)
    assert row["all"] == pytest.approx(36.0 ** (1 / 3)) and row[settings.WRONG] == pytest.approx(4)
    assert row["above 5 mm [%]"] == pytest.approx(10) and row["inside 95 % [%]"] == pytest.approx(
        90
    )
    axes = settings.figure([row | {"settings": settings.RECOMMENDED}, row]).axes[0]
    assert [line.get_xdata()[0] for line in axes.lines[:2]] == [1.0, 1.0]


def test_a_lost_object_counts_as_the_worst():
    assert settings._mean(np.array([np.inf, 0.0])) == settings.WORST_MM / 2.0
