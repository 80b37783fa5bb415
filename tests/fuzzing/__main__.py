# SPDX-License-Identifier: MIT
"""``make fuzz``: mutated inputs for a bounded time; exit code 1 where one of them was not held."""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import TypeVar

import numpy as np

from . import child
from .kinds import KINDS, Kind
from .mutate import mutated

CORPUS = Path(__file__).parent / "corpus"
Use = Callable[[np.random.Generator], str]
Outcome = TypeVar("Outcome")
WARM = 4  # seeds that are used once beforehand
SHOWN = 3  # findings of a kind that are printed in full


def fuzz(
    name: str, seed: int, count: int, seconds: float, keep: Path | None = None
) -> tuple[int, list[tuple[str, child.Outcome]]]:
    """Try inputs of one kind: how many were tried, and what was not held, by file name.

    Args:
        name: The kind.
        seed: Of all randomness.
        count: Most inputs.
        seconds: Longest time [s], after what has to be made first; an input that was begun is finished.
        keep: Folder for the inputs that were not held, in folders named by kind.
    """
    kind = KINDS[name]
    findings = []
    tried = 0
    with tempfile.TemporaryDirectory() as folder:
        seeds = _seeds(kind, Path(folder) / "seeds")
        with open(os.devnull, "w") as nowhere, redirect_stdout(nowhere), redirect_stderr(nowhere):
            for file, data in list(zip(kind.names, seeds, strict=True))[
                :WARM
            ]:  # what is slow is loaded once, before the copies
                _in_place(kind, Path(folder), file, data, lambda use: use(np.random.default_rng(0)))
        end = time.monotonic() + seconds
        for label, file, data in _inputs(name, kind, seeds, seed, count):
            if time.monotonic() > end:
                break
            tried += 1
            rng = np.random.default_rng([seed, tried])
            outcome = _in_place(
                kind,
                Path(folder),
                file,
                data,
                lambda use, rng=rng: child.run(lambda: use(rng), Path(folder)),
            )
            if outcome.problem:
                findings.append((label, outcome))
                if keep is not None:
                    (keep / name / label).mkdir(parents=True, exist_ok=True)
                    (keep / name / label / file).write_bytes(data)
    return tried, findings


def _seeds(kind: Kind, folder: Path) -> list[bytes]:
    folder.mkdir()
    return kind.seeds(folder)


def _inputs(
    name: str, kind: Kind, seeds: list[bytes], seed: int, count: int
) -> Iterator[tuple[str, str, bytes]]:
    """Label, file name and content of each input: the corpus first."""
    for path in sorted((CORPUS / name).glob("*/*")):
        yield path.parent.name, path.name, path.read_bytes()
    for number in range(count):
        rng = np.random.default_rng([seed, number, sorted(KINDS).index(name)])
        place = int(rng.integers(len(kind.names)))
        yield f"{seed}-{number}", kind.names[place], mutated(seeds[place], seeds, rng)


def _in_place(
    kind: Kind, folder: Path, file: str, data: bytes, call: Callable[[Use], Outcome]
) -> Outcome:
    """Call with what uses the input, which lies in a fresh copy of the seeds' folder for the time."""
    place = folder / "input"
    shutil.copytree(folder / "seeds", place)
    path = place / "given" / file
    path.parent.mkdir()
    path.write_bytes(data)
    try:
        return call(lambda rng: kind.use(path, place, rng))
    finally:
        shutil.rmtree(place)


def main() -> int:
    """Fuzz all kinds, or the named ones."""
    parser = argparse.ArgumentParser(prog="python -m fuzzing", description=__doc__)
    parser.add_argument("kinds", nargs="*", help=f"of {', '.join(KINDS)}; all where none is named")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--count", type=int, default=10**9, help="most inputs of each kind")
    parser.add_argument("--seconds", type=float, default=60.0, help="for each kind")
    parser.add_argument("--keep", type=Path, help="folder for inputs that were not held")
    given = parser.parse_args()
    found = 0
    for name in given.kinds or KINDS:
        start = time.monotonic()
        tried, findings = fuzz(name, given.seed, given.count, given.seconds, given.keep)
        found += len(findings)
        spent = time.monotonic() - start
        print(f"{name}: {tried} inputs in {spent:.0f} s, {len(findings)} not held", flush=True)
        lasts = Counter(o.problem.strip().splitlines()[-1][:200] for _, o in findings)
        for problem, times in lasts.most_common(10):
            print(f"  {times} times: {problem}")
        for label, outcome in findings[:SHOWN]:
            print(f"  {label}: {outcome.problem}\n{outcome.said[-500:]}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
