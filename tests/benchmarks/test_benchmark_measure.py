# SPDX-License-Identifier: MIT
import mmap
import time

import gtsam
import numpy as np
import pytest

from benchmarks import breakdown, measure, problems, scaling, soak
from benchmarks.breakdown import CALLBACKS, GTSAM, OUTSIDE, SEARCH, Stopwatch, watched
from benchmarks.clock import Time, timed
from benchmarks.measure import Times, ratio, take_turns
from benchmarks.ours import Ours
from benchmarks.report import machine, table
from benchmarks.solver import Solved


@pytest.fixture(scope="module")
def problem():
    return problems.sequence(20, sdf=problems.lump(32))


class Fake:
    """Says it took ``seconds`` and moves 1 mm along x."""

    def __init__(self, name, seconds, log):
        self.name, self.seconds, self.log = name, seconds, log

    def solve(self, frame, T_start, batch=1):
        self.log.append((self.name, frame, round(1e3 * T_start[0, 0, 3], 6)))
        T_wo = T_start.copy()
        T_wo[:, 0, 3] += 1e-3
        return Solved(T_wo, Time(self.seconds, self.seconds, False))


def test_a_call_is_timed_on_the_clock_and_on_the_core():
    taken, result = timed(lambda: time.sleep(0.05) or "done")
    assert result == "done"
    assert taken.wall >= 0.05 > 0.02 > taken.cpu


def test_solvers_take_turns_block_by_block_over_the_same_frames(problem):
    log = []
    fakes = [Fake("a", 1e-3, log), Fake("b", 2e-3, log)]
    times = take_turns(fakes, problem, 6, block=3)
    assert [name for name, *_ in log[2:]] == ["a"] * 4 + ["b"] * 4 + ["a"] * 4 + ["b"] * 4
    assert [frame for _, frame, _ in log[2:6]] == [5, 0, 1, 2]  # the one before is not counted
    assert [len(block) for block in times[0].blocks] == [3, 3]


def test_frame_by_frame_nothing_is_solved_twice(problem):
    log = []
    take_turns([Fake("a", 1e-3, log), Fake("b", 1e-3, log)], problem, 3, block=1)
    assert [(name, frame) for name, frame, _ in log[2:]] == [(s, n) for n in range(3) for s in "ab"]


def test_a_tracked_frame_starts_where_the_solver_left_the_previous_one(problem):
    log = []
    take_turns([Fake("a", 1e-3, log)], problem, 4, block=2, tracked=True)
    begin = round(1e3 * problem.T_start[0, 0, 3], 6)
    starts = [x - begin for _, _, x in log[1:]]
    counted = [starts[n] for n in (1, 2, 4, 5)]  # without the one before each block
    assert counted == pytest.approx([0, 1, 2, 3], abs=1e-5)


def test_the_ratio_is_the_median_over_pairs_of_blocks():
    fast = Times(
        "fast", [[Time(1, 1, False)] * 3, [Time(1, 1, False)] * 3, [Time(2, 2, False)] * 3]
    )
    slow = Times(
        "slow", [[Time(5, 10, True)] * 3, [Time(5, 20, True)] * 3, [Time(5, 60, True)] * 3]
    )
    assert ratio(slow, fast)["median"] == 20
    assert ratio(slow, fast, "wall")["median"] == 5
    assert slow.summary() | {"frames": 9, "median_ms": 2e4, "interrupted": 1.0} == slow.summary()


def test_batches_count_a_frame(problem):
    fake = Fake("a", 0.04, [])
    assert measure.in_batches(fake, problem, 4, 3) == pytest.approx(10)


def test_the_slope_of_a_power_law_is_its_exponent():
    values = (1, 2, 4, 8)
    assert scaling.slope(values, [3 * v**0.5 for v in values]) == pytest.approx(0.5)


def test_sweeps_build_the_problem_they_name():
    assert scaling._pads(32, 1).pads == 32
    assert len(scaling._points(64, 1).points_p) == 16 * 64
    assert scaling._resolution(48, 1).values.shape == (48, 48, 48)
    assert scaling._iterations(7, 1).iterations == 7


def test_a_part_of_a_frame_is_not_charged_for_the_parts_that_it_calls(monkeypatch):
    now = iter(range(100))
    monkeypatch.setattr(breakdown.time, "perf_counter", lambda: next(now))
    watch = Stopwatch()
    search = watch.around(SEARCH, lambda: "found")
    optimise = watch.around(GTSAM, lambda: [search(), search()])
    assert optimise() == ["found", "found"]
    assert watch.seconds[GTSAM] == 3 and watch.seconds[SEARCH] == 2
    assert watch.calls == {GTSAM: 1, SEARCH: 2}


def test_the_stopwatch_goes_back_to_the_caller_where_a_part_fails():
    watch = Stopwatch()

    def fails():
        raise ValueError

    with pytest.raises(ValueError):
        watch.around(GTSAM, watch.around(SEARCH, fails))()
    assert watch.now == OUTSIDE


def test_the_stopwatch_stands_at_the_estimators_doors_and_leaves_them_as_they_were(problem):
    ours, watch = Ours(problem, "fixed-damping"), Stopwatch()
    make = gtsam.CustomFactor
    with watched(watch):
        seen = ours.solve(0, problem.T_start[:1])
    assert gtsam.CustomFactor is make
    assert watch.calls[SEARCH] == problem.iterations + 2  # where it ends: error, then every pad
    assert watch.calls[CALLBACKS] == 2 * (problem.iterations + 2)
    np.testing.assert_array_equal(seen.T_wo, ours.solve(0, problem.T_start[:1]).T_wo)
    assert watch.calls[SEARCH] == problem.iterations + 2


def test_memory_growth_is_told_from_the_tenth_of_the_run_on():
    samples = [
        {"frame": 10 * n, "memory_mb": 100.0 + (50 if n == 0 else n), "median_ms": 1.0}
        for n in range(51)
    ]
    assert "grew by 45.0 MB" in soak.words("lm", samples)


def test_memory_is_read_in_megabytes():
    before = soak.memory_mb()
    with mmap.mmap(-1, 20_000_000) as block:
        block.write(bytes(20_000_000))
        assert 15 < soak.memory_mb() - before < 60  # the written bytes are an object as well


def test_a_table_is_markdown_with_numbers_to_the_right():
    text = table(
        [{"name": "a", "x [ms]": 1.23456, "n": None}, {"name": "long", "x [ms]": 234.5, "n": 3}]
    )
    assert text.splitlines() == [
        "| name | x [ms] |   n |",
        "| ---- | -----: | --: |",
        "| a    |   1.23 |   - |",
        "| long |    234 |   3 |",
    ]


def test_the_machine_and_the_versions_are_named():
    found = machine()
    assert found["cpu"] and found["gtsam"].startswith("4.3")
