# SPDX-License-Identifier: MIT
"""The how-to's programs run as they are printed, one after the other, and find what the page says."""

import re
from pathlib import Path

import gtsam
import numpy as np
import pytest
from gtsam.symbol_shorthand import B, M, X

import vtgtsam

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "own-graph.md"
PROGRAMS = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
FRAME, FACTOR, WINDOW, SMOOTHER, TWO = range(5)


@pytest.fixture(scope="module")
def after():
    """What the programs have left, after each of them."""
    left, found = [], {}
    for program in PROGRAMS:
        exec(compile(program, str(PAGE), "exec"), found)
        left.append(dict(found))
    return left


def test_the_page_uses_public_names_only():
    names = re.findall(r"from vtgtsam(\S*) import (.*)", "".join(PROGRAMS))
    assert len(names) >= 2
    for module, imported in names:
        assert module == ""
        assert set(imported.split(", ")) <= set(vtgtsam.__all__)


def test_a_frames_graph_finds_the_pose_that_vision_reports(after):
    assert isinstance(after[FRAME]["graph"], gtsam.NonlinearFactorGraph)
    found = after[FRAME]["T_ho"].translation()
    np.testing.assert_allclose(found, [0.10, 0.05, 0.12], atol=1e-6)


def test_a_factor_of_ones_own_counts(after):
    z = after[FACTOR]["T_ho"].z()
    # 5 mm apart, weights of 1/3^2 and 1/1^2; vision's loss lets go a little as well
    assert 0.12 + 0.005 * 0.9 <= z < 0.125


def test_a_window_does_not_follow_a_jump_of_the_tracker(after):
    smoothed = after[WINDOW]["smoothed"]
    x = [smoothed.atPose3(X(n)).x() for n in range(5)]
    assert after[WINDOW]["positions"][2] == 0.13
    assert np.ptp(x) < 0.003 and abs(x[2] - 0.10) < 0.01


def test_a_smoother_takes_the_same_graphs_and_forgets_old_frames(after):
    smoother = after[SMOOTHER]["smoother"]
    kept = sorted(smoother.calculateEstimate().keys())
    assert kept == [X(n) for n in (2, 3, 4)]
    smoothed = after[WINDOW]["smoothed"].atPose3(X(4))
    assert after[SMOOTHER]["T_ho"].equals(smoothed, 2e-3)


def test_two_objects_have_a_pose_each(after):
    found = after[TWO]["found"]
    assert set(found.keys()) == {B(0), M(0)}
    for key, place in ((M(0), [0.10, 0.05, 0.12]), (B(0), [0.10, -0.08, 0.12])):
        np.testing.assert_allclose(found.atPose3(key).translation(), place, atol=0.01)
