# SPDX-License-Identifier: MIT
"""The error of a registration: 5 mm and 5 degrees at the object's centre."""

import numpy as np
import pytest

from sim.registration import drawn_registration


@pytest.mark.parametrize("seed", range(3))
def test_the_centre_moves_by_5_mm_and_the_object_turns_by_5_degrees(seed):
    center_o = np.array([0.1, -0.02, 0.3])
    T = drawn_registration(center_o, np.random.default_rng(seed))
    assert np.linalg.norm(T.transformFrom(center_o) - center_o) == pytest.approx(0.005)
    _, angle = T.rotation().axisAngle()
    assert np.degrees(angle) == pytest.approx(5.0)


def test_seeds_give_different_directions_and_the_same_seed_the_same():
    first, again, other = (
        drawn_registration(np.zeros(3), np.random.default_rng(seed)) for seed in (1, 1, 2)
    )
    assert first.equals(again, 0.0) and not first.equals(other, 1e-3)
