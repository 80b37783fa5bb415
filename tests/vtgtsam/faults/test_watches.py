# SPDX-License-Identifier: MIT
"""Each watch by itself: what it takes for a fault, and what not."""

from typing import NamedTuple

import numpy as np
import pytest

from vtgtsam.faults.fit import fits_nowhere
from vtgtsam.faults.inversion import InversionWatch
from vtgtsam.faults.lasting import Lasting
from vtgtsam.faults.pads import PadWatch

PERIOD = 1 / 30
NAMES = tuple("abcdefgh")
TOUCHING = np.array([1, 1, 1, 0, 0, 0, 0, 0], dtype=bool)
NEAR = np.where(TOUCHING, 0.0, 0.02)  # [m], pads that do not touch are away


def watched(watch, bits, distances, known=True, seconds=1.0, start=0.0):
    """Whether each frame's bits count as inverted after it."""
    found = []
    for n in range(round(seconds / PERIOD)):
        watch.before(bits)
        found.append(watch.after(start + n * PERIOD, bits, distances, known))
    return found


def test_bits_that_turn_over_at_once_are_inverted_from_that_frame_on_and_right_again_when_they_turn_back():
    watch = InversionWatch()
    assert not any(watched(watch, TOUCHING, NEAR))
    assert watch.before(~TOUCHING)
    assert all(watched(watch, ~TOUCHING, NEAR, start=1.0))
    assert not watch.before(TOUCHING)


def test_pads_that_release_or_close_together_are_not_inverted():
    watch = InversionWatch()
    everything = np.ones(8, dtype=bool)
    for bits in (~everything, everything, ~everything, TOUCHING, ~everything):
        assert not watch.before(bits)


def test_bits_that_were_inverted_from_the_start_are_known_by_where_the_object_is():
    found = watched(InversionWatch(), ~TOUCHING, NEAR)
    assert not found[0] and found[-1]
    assert not any(watched(InversionWatch(), ~TOUCHING, NEAR, known=False))


def test_bits_that_fit_the_object_are_believed_again():
    watch = InversionWatch()
    watched(watch, ~TOUCHING, NEAR)
    assert watch.inverted
    few = np.array([1, 1, 0, 0, 0, 0, 0, 0], dtype=bool)  # they turned back while nobody looked
    assert not watched(watch, few, NEAR, start=2.0)[-1]


def faults(bits, distances, known=True, seconds=1.0):
    watch = PadWatch(NAMES)
    for n in range(round(seconds / PERIOD)):
        found = watch.after(n * PERIOD, np.array(bits(n)), distances, known)
    return found


def test_a_pad_that_touches_far_from_the_object_disagrees():
    stuck = TOUCHING.copy()
    stuck[5] = True
    assert faults(lambda _: stuck, NEAR) == ("pad f disagrees with the rest",)
    assert faults(lambda _: stuck, NEAR, seconds=0.2) == ()
    assert faults(lambda _: stuck, NEAR, known=False) == ()
    assert faults(lambda _: TOUCHING, NEAR) == ()


def test_a_pad_that_changes_in_nearly_every_frame_flickers():
    def flickering(n):
        bits = TOUCHING.copy()
        bits[0] = n % 2
        return bits

    assert faults(flickering, NEAR, seconds=0.7) == ("pad a flickers",)
    assert faults(flickering, NEAR, seconds=0.4) == ()


def test_an_object_does_not_fit_where_most_pads_that_touch_are_off_its_surface():
    off = np.where(TOUCHING, 0.006, 0.02)
    assert faults(lambda _: TOUCHING, off) == ("object does not fit",)
    assert faults(lambda _: TOUCHING, off / 2) == ()


class Ball(NamedTuple):
    """A ball of 30 mm radius, as its distance field would answer."""

    center: np.ndarray

    def at(self, points):
        away = points - self.center
        length = np.linalg.norm(away, axis=1)
        return length - 0.03, away / length[:, None]


SIDES = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], dtype=float)


@pytest.mark.parametrize("radius, expected", [(0.02, True), (0.03, False), (0.04, True)])
def test_a_ball_of_another_size_fits_nowhere_between_opposite_pads(radius, expected):
    ball = Ball(np.zeros(3))
    assert fits_nowhere(*ball.at(radius * SIDES)) == expected
    assert fits_nowhere(*ball.at(radius * SIDES[:2])) == expected
    assert not fits_nowhere(*ball.at(radius * SIDES[[0, 2]]))  # it may be farther to one side


def test_a_ball_that_is_seen_beside_its_place_fits():
    off = Ball(np.array([0.012, 0.0, 0.0]))
    assert not fits_nowhere(*off.at(0.03 * SIDES))


def test_a_condition_lasts_only_without_a_break():
    lasting = Lasting(0.2)
    assert [lasting.holds(t, t != 0.3) for t in (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.61)] == [
        False, False, True, False, False, False, True,
    ]  # fmt: skip
