# SPDX-License-Identifier: MIT
"""The how-to's program runs as it is printed, and its own factor counts."""

import re
from pathlib import Path

import gtsam
import numpy as np

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "own-graph.md"


def test_the_program_of_the_page_finds_a_pose_between_vision_and_its_own_factor():
    (program,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    found: dict[str, object] = {}
    exec(compile(program, str(PAGE), "exec"), found)
    x = found["T_wo"].translation()[0]
    assert isinstance(found["graph"], gtsam.NonlinearFactorGraph)
    assert 0.1001 < x < 0.1099
    np.testing.assert_allclose(
        found["T_wo"].translation()[1:], [0.05, 0.10], atol=3e-3
    )  # a pad is in it
