# SPDX-License-Identifier: MIT
"""What evaluating recordings costs: processor time, memory and disk, and what many hours would.

    python tools/cost.py demo-output/seed-0/judging --hours 10000

Evaluates growing numbers of copies of the given recordings, and one recording made longer and longer, each
in a fresh process. Prints what was measured, and what follows for many hours from the slopes.
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import shutil
import tempfile
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

METHODS = ("vis", "vis+pen", "vis+tac+pen")
COPIES = (1, 2, 4)  # of all recordings
LENGTHS = (1, 4, 8)  # times one recording's


@dataclass(frozen=True)
class Cost:
    """What one call of evaluate cost.

    Attributes:
        hours: Length of what it evaluated [h].
        sequences: Number of recordings.
        seconds: Processor time [s].
        again: Processor time of a second call, which finds all sequences done [s].
        memory: Largest resident size of the process [MB].
        memory_again: The same for the second call, which only makes tables [MB].
        read: Size of the recordings [MB].
        written: Size of what it wrote [MB].
        files: Number of files it wrote.
    """

    hours: float
    sequences: int
    seconds: float
    again: float
    memory: float
    memory_again: float
    read: float
    written: float
    files: int


def cost_of(recordings: Path, out: Path) -> Cost:
    """Evaluate a folder twice, each time in a process that measures itself."""
    (seconds, memory), (again, memory_again) = (_in_process(recordings, out) for _ in range(2))
    given = sorted(recordings.glob("*.mcap"))
    written = [file for file in out.rglob("*") if file.is_file()]
    return Cost(
        hours=sum(_hours(path) for path in given),
        sequences=len(given),
        seconds=seconds,
        again=again,
        memory=memory,
        memory_again=memory_again,
        read=_megabytes(given),
        written=_megabytes(written),
        files=len(written),
    )


def _in_process(recordings: Path, out: Path) -> tuple[float, float]:
    context = multiprocessing.get_context("spawn")
    answers, answer = context.Pipe(duplex=False)
    process = context.Process(target=_evaluate, args=(recordings, out, answer))
    process.start()
    answer.close()
    seconds, memory = answers.recv()
    process.join()
    return seconds, memory


def _evaluate(recordings: Path, out: Path, answer: Connection) -> None:
    from vtgtsam import evaluate

    evaluate(recordings, METHODS, "tuned", out)
    usage = resource.getrusage(resource.RUSAGE_SELF)
    answer.send((usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e3))


def _megabytes(files: list[Path]) -> float:
    return sum(file.stat().st_size for file in files) / 1e6


def _hours(recording: Path) -> float:
    from vtgtsam import read_recording

    times_ns = read_recording(recording).streams.joints.times_ns
    return float(times_ns[-1] - times_ns[0]) / 3.6e12


def copies(recordings: list[Path], count: int, folder: Path) -> Path:
    """A folder with that many copies of each recording."""
    folder.mkdir()
    for path in recordings:
        for k in range(count):
            shutil.copy(path, folder / f"{path.stem}_copy{k}.mcap")
    return folder


def longer(recording: Path, times: int, folder: Path) -> Path:
    """A folder with one recording that goes through another one several times."""
    from vtgtsam import read_recording
    from vtgtsam.recording import RecordingWriter
    from vtgtsam.recording.convert import entries_of
    from vtgtsam.recording.provenance import mesh_file

    folder.mkdir()
    original = read_recording(recording)
    entries = sorted(entries_of(original), key=lambda entry: entry.stamp_ns)
    length_ns = entries[-1].stamp_ns - entries[0].stamp_ns + 10**7
    hand, mesh = original.hand.xml, mesh_file(original.object)
    with RecordingWriter(folder / "long.mcap", original.info, hand_xml=hand, mesh=mesh) as writer:
        for turn in range(times):
            for entry in entries:
                later = turn * length_ns
                instants = (entry.stamp_ns + later) / 1e9, (entry.known_ns + later) / 1e9
                entry.write(writer, *instants)
    return folder


def slope(costs: list[Cost], name: str) -> tuple[float, float]:
    """How much a quantity grows with an hour more, and the standard error of that, by least squares."""
    hours = np.array([cost.hours for cost in costs])
    values = np.array([getattr(cost, name) for cost in costs])
    line = np.polyfit(hours, values, 1)
    scatter = np.sum((values - np.polyval(line, hours)) ** 2) / (len(hours) - 2)
    return float(line[0]), float(np.sqrt(scatter / np.sum((hours - hours.mean()) ** 2)))


def measured(costs: list[Cost]) -> list[str]:
    """The table of what was measured."""
    lines = [
        "| recordings | length [s] | processor time [s] | second call [s] | memory [MB] "
        "| second call [MB] | read [MB] | written [MB] | files |",
        "|--:|--:|--:|--:|--:|--:|--:|--:|--:|",
    ]
    for c in costs:
        lines.append(
            f"| {c.sequences} | {3600 * c.hours:.0f} | {c.seconds:.1f} | {c.again:.1f} "
            f"| {c.memory:.0f} | {c.memory_again:.0f} | {c.read:.1f} | {c.written:.1f} | {c.files} |"
        )
    return lines


def extrapolated(many: list[Cost], long: list[Cost], hours: float) -> list[str]:
    """What an hour more costs, and what that makes of many."""
    rows = [
        ("processor time", slope(many, "seconds"), "s", hours / 3600, "h"),
        ("of which tables and figures", slope(many, "again"), "s", hours / 3600, "h"),
        ("recordings", slope(many, "read"), "MB", hours / 1e6, "TB"),
        ("results", slope(many, "written"), "MB", hours / 1e6, "TB"),
        ("result files", slope(many, "files"), "", hours / 1e6, "million"),
        ("memory for the tables", slope(many, "memory_again"), "MB", hours / 1e6, "TB"),
        ("memory of a process, for one recording", slope(long, "memory"), "MB", 0.0, ""),
    ]
    lines = [f"| | an hour of recordings | {hours:,.0f} hours |", "|---|--:|--:|"]
    for what, (each, error), unit, factor, large in rows:
        # What is lost in the scatter is given as what it is less than.
        least = each < 2 * error
        value, sign = (max(each, 0.0) + 2 * error, "< ") if least else (each, "")
        total = f"{sign}{_rounded(value * factor)} {large}" if factor else "the same"
        lines.append(f"| {what} | {sign}{_rounded(value)} {unit} | {total} |")
    return lines


def _rounded(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.2g}"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recordings", type=Path, help="folder of .mcap files")
    parser.add_argument("--hours", type=float, default=10_000, help="to extrapolate to")
    arguments = parser.parse_args()
    paths = sorted(arguments.recordings.rglob("*.mcap"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # Once unmeasured: what is compiled and what is kept in a cache is there from then on.
        cost_of(copies(paths, 1, folder / "warm"), folder / "outwarm")
        many = [cost_of(copies(paths, n, folder / f"in{n}"), folder / f"out{n}") for n in COPIES]
        long = [
            cost_of(longer(paths[0], n, folder / f"long{n}"), folder / f"outlong{n}")
            for n in LENGTHS
        ]
    print("\n".join(measured(many + long)), end="\n\n")
    print("\n".join(extrapolated(many, long, arguments.hours)))


if __name__ == "__main__":
    main()
