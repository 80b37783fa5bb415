# SPDX-License-Identifier: MIT
from __future__ import annotations

from vtgtsam.live.stamps import BELIEVED, StampGuard

S = 10**9


def judged(stamps, period=S // 100):
    guard = StampGuard()
    return guard, [guard.judge(stamp, k * period) for k, stamp in enumerate(stamps)]


def test_stamps_that_follow_each_other_are_fine_also_out_of_order_and_after_a_pause():
    guard = StampGuard()
    assert guard.judge(5 * S, 0) == "fine"
    assert guard.judge(5 * S - S // 2, S // 100) == "fine"
    assert guard.judge(35 * S, 30 * S) == "fine"
    assert guard.odd == 0


def test_one_stamp_from_elsewhere_is_refused():
    guard, verdicts = judged([100 * S, 3700 * S, 100 * S + 1, 100 * S + 2])
    assert verdicts == ["fine", "odd", "fine", "fine"]
    assert guard.odd == 1
    assert guard.apart == 3600.0


def test_a_clock_that_has_gone_back_is_believed_after_some():
    back = [100 * S] + [10 * S + k for k in range(BELIEVED + 2)]
    _, verdicts = judged(back)
    assert verdicts[1:] == ["odd"] * (BELIEVED - 1) + ["back", "fine", "fine"]


def test_a_clock_that_has_gone_ahead_is_believed_after_some():
    _, verdicts = judged([100 * S] + [900 * S + k for k in range(BELIEVED + 1)])
    assert verdicts[1:] == ["odd"] * (BELIEVED - 1) + ["fine", "fine"]


def test_a_second_publisher_with_another_clock_is_refused_for_good():
    stamps = [stamp for k in range(50) for stamp in (100 * S + k, 10 * S + k)]
    guard, verdicts = judged(stamps)
    assert verdicts == ["fine", "odd"] * 50
    assert guard.odd == 50
