# SPDX-License-Identifier: MIT
import os
import sys

import pytest

from vtgtsam.evaluation.engine import run_tasks
from vtgtsam.exceptions import VtgtsamError


def square(x: int) -> int:
    return x * x


def die(x: int) -> None:
    os._exit(1)


def blas_threads(x: int) -> list[int]:
    import numpy
    from threadpoolctl import threadpool_info

    numpy.zeros(1)
    return [pool["num_threads"] for pool in threadpool_info()]


@pytest.mark.parametrize("jobs", [1, 2])
def test_each_task_is_done_once(jobs):
    assert sorted(run_tasks(square, range(8), jobs)) == [x * x for x in range(8)]


def test_tasks_are_drawn_as_they_are_needed_not_all_at_once():
    drawn = []
    results = run_tasks(square, (drawn.append(x) or x for x in range(1000)), jobs=1)
    assert next(results) == 0
    assert drawn == [0]


def test_workers_use_one_thread_each():
    assert set(sum(run_tasks(blas_threads, range(2), jobs=2), [])) <= {1}


def test_a_worker_that_dies_is_said():
    with pytest.raises(VtgtsamError, match="a worker process died"):
        list(run_tasks(die, range(2), jobs=2))


def test_without_dask_one_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(VtgtsamError, match=r"distributed: pip install .*\[cluster\]'"):
        list(run_tasks(square, range(2), scheduler="tcp://127.0.0.1:1"))


@pytest.mark.slow
def test_a_scheduler_that_does_not_answer_is_said():
    pytest.importorskip("distributed")
    with pytest.raises(VtgtsamError, match="no Dask scheduler answers at tcp://127.0.0.1:9"):
        list(run_tasks(square, range(2), scheduler="tcp://127.0.0.1:9"))
