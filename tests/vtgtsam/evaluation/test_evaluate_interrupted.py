# SPDX-License-Identifier: MIT
"""Killed runs and a cluster give the bytes of an undisturbed run in one process."""

import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest
from held_box import write_grasp

from vtgtsam import evaluate
from vtgtsam.evaluation import folder

METHODS = ("vis", "vis+tac+pen")
SEQUENCES = 6


def tree(folder: Path) -> dict[str, str]:
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def grasps(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("grasps")
    for seed in range(SEQUENCES):
        write_grasp(folder / f"{seed}.mcap", seed=seed, frames=60)
    return folder


@pytest.fixture(scope="module")
def undisturbed(grasps, tmp_path_factory) -> dict[str, str]:
    out = tmp_path_factory.mktemp("undisturbed")
    evaluate(grasps, METHODS, "tuned", out)
    return tree(out)


@contextmanager
def started(*arguments, **options):
    """A process and all that it starts, killed at the end."""
    process = subprocess.Popen(
        [sys.executable, "-m", *map(str, arguments)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
        **options,
    )
    try:
        yield process
    finally:
        try:
            os.killpg(process.pid, signal.SIGKILL)
        except ProcessLookupError:
            pass
        process.wait()


def wait_until(condition, timeout=60.0):
    end = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)


@pytest.mark.parametrize(
    "done", [pytest.param(0, marks=pytest.mark.slow), 2, pytest.param(4, marks=pytest.mark.slow)]
)
def test_killed_with_two_workers_the_next_call_finishes_it(grasps, undisturbed, tmp_path, done):
    command = ("vtgtsam.cli", "evaluate", grasps, "--out", tmp_path, "--jobs", 2)
    parts = tmp_path / "metrics"
    with started(*command, "--methods", ",".join(METHODS)):
        wait_until(
            lambda: (tmp_path / "estimates").exists() and len(list(parts.glob("*.p*"))) >= done
        )
    assert not (tmp_path / "metrics.parquet").exists()
    evaluate(grasps, METHODS, "tuned", tmp_path)
    assert tree(tmp_path) == undisturbed


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="looks at processes in /proc")
@pytest.mark.parametrize("seed", range(10))
def test_killed_three_times_at_random_instants_nothing_runs_on_and_the_bytes_are_the_same(
    grasps, undisturbed, tmp_path, seed
):
    rng = np.random.default_rng(seed)
    command = ("vtgtsam.cli", "evaluate", grasps, "--out", tmp_path, "--jobs", 2)
    for _ in range(3):
        with started(*command, "--methods", ",".join(METHODS)) as parent:
            time.sleep(rng.uniform(0.5, 10.0))
            processes = [parent.pid, *descendants(parent.pid)]
            doomed = rng.choice(processes)  # the call itself, a worker, or a helper
            with suppress(ProcessLookupError):  # it has just ended
                os.kill(doomed, rng.choice([signal.SIGKILL, signal.SIGTERM]))
            parent.wait(timeout=120)
            wait_until(lambda running=processes: not any(map(runs, running)), timeout=10)
    evaluate(grasps, METHODS, "tuned", tmp_path)
    folder.release_below(tmp_path, "figures", "report.html")
    assert tree(tmp_path) == undisturbed


def descendants(process: int) -> list[int]:
    """All processes that it or its children have started and that still have them as parents."""
    try:
        tasks = list(Path(f"/proc/{process}/task").iterdir())
        children = [int(c) for t in tasks for c in (t / "children").read_text().split()]
    except (FileNotFoundError, ProcessLookupError):
        return []
    return [below for child in children for below in (child, *descendants(child))]


def runs(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state != "Z"


@pytest.mark.slow
def test_a_cluster_that_loses_a_worker_gives_the_same_bytes(grasps, undisturbed, tmp_path):
    pytest.importorskip("distributed")
    contact, out = tmp_path / "scheduler.json", tmp_path / "out"
    local = ("--scheduler-file", contact, "--no-dashboard")
    scheduler = ("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", 0, *local)
    worker = ("distributed.cli.dask_worker", "--no-nanny", "--nthreads", 1, *local)
    with started(*scheduler), started(*worker, cwd=tmp_path), started(*worker) as doomed:
        address = scheduler_address(contact, workers=2)
        command = ("vtgtsam.cli", "evaluate", grasps, "--out", out, "--scheduler", address)
        with started(*command, "--methods", ",".join(METHODS)) as run:
            wait_until((out / "estimates").exists)
            doomed.kill()
            assert run.wait(timeout=120) == 0
    folder.release_below(
        out, "figures", "report.html"
    )  # which the command makes and the function does not
    assert tree(out) == undisturbed


def scheduler_address(contact: Path, workers: int) -> str:
    from distributed import Client

    wait_until(lambda: contact.exists() and contact.read_text().endswith("}"))  # written in full
    address = json.loads(contact.read_text())["address"]
    with Client(address, set_as_default=False) as client:
        client.wait_for_workers(workers, timeout=60)
    return address
