# SPDX-License-Identifier: MIT
"""Call one function on many tasks: here, in several processes, or on a Dask cluster."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any, TypeVar

from ..exceptions import VtgtsamError
from ..extras import require
from .parent import end_with_parent
from .resume import code_version

Task = TypeVar("Task")
Result = TypeVar("Result")


def run_tasks(
    function: Callable[[Task], Result],
    tasks: Iterable[Task],
    jobs: int = 1,
    scheduler: str | None = None,
) -> Iterator[Result]:
    """Results in the order in which they are ready.

    Args:
        function: Called once a task, possibly in another process.
        tasks: Its arguments; drawn as workers get free.
        jobs: Processes on this machine. One works in the calling process.
        scheduler: Address of a Dask scheduler, "tcp://HOST:PORT", whose workers do the work instead.

    Raises:
        VtgtsamError: A worker died; or the scheduler cannot be reached, or its workers run other code.
    """
    if scheduler is None and jobs == 1:
        yield from map(function, tasks)
        return
    require("evaluate", "several processes need", "joblib", "threadpoolctl")
    import joblib
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    backend = _local() if scheduler is None else _dask(scheduler)
    count = jobs if scheduler is None else -1
    try:
        with backend:
            parallel = joblib.Parallel(n_jobs=count, batch_size=1, return_as="generator_unordered")
            yield from parallel(joblib.delayed(function)(task) for task in tasks)
    except TerminatedWorkerError as error:
        raise VtgtsamError(
            "a worker process died, out of memory perhaps; finished sequences are kept: "
            "call again, with fewer --jobs if it happens again"
        ) from error


def _local() -> AbstractContextManager[Any]:
    import joblib

    try:
        multiprocessing.get_context("spawn").Lock()
    except OSError as error:
        raise VtgtsamError(
            f"processes cannot share locks here ({error}), as where /dev/shm is read-only; give --jobs 1"
        ) from None
    return joblib.parallel_config(  # type: ignore[no-any-return]
        backend="loky",
        inner_max_num_threads=1,
        initializer=end_with_parent,
        initargs=(os.getpid(),),
    )


@contextmanager
def _dask(scheduler: str) -> Iterator[None]:
    require("cluster", "a Dask scheduler needs", "distributed")
    import joblib
    from distributed import Client

    try:
        client = Client(scheduler, timeout="10s", set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise VtgtsamError(f"no Dask scheduler answers at {scheduler}: {error}") from error
    with client:
        _check_workers(client, scheduler)
        with joblib.parallel_config(backend="dask", client=client):
            yield


def _check_workers(client: Any, scheduler: str) -> None:
    versions = client.run(code_version)
    if not versions:
        raise VtgtsamError(f"the Dask scheduler at {scheduler} has no workers; start some first")
    others = set(versions.values()) - {code_version()}
    if others:
        raise VtgtsamError(
            f"workers at {scheduler} have vtgtsam {', '.join(sorted(others))}, this program has "
            f"{code_version()}; install the same everywhere"
        )
