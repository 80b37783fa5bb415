# SPDX-License-Identifier: MIT
"""What a benchmark leaves behind: a table, a JSON file with machine and versions, a figure."""

from __future__ import annotations

import json
import os
import platform
import subprocess
import time
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

RESULTS = Path(__file__).resolve().parent / "results"
PACKAGES = ("vtgtsam", "gtsam", "numpy", "numba", "scipy")


def machine() -> dict[str, Any]:
    """Where and with what this runs."""
    return {
        "cpu": _cpu(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
        "commit": _commit(),
        "date": time.strftime("%Y-%m-%d", time.gmtime()),
        "load": round(os.getloadavg()[0], 1),
    } | {name: version(name) for name in PACKAGES}


def _cpu() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def _commit() -> str | None:
    command = ["git", "-C", str(Path(__file__).parent), "describe", "--always"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None  # a checkout without git


def table(rows: list[dict[str, Any]]) -> str:
    """A Markdown table; floats with three figures, text to the left."""
    columns = list(rows[0])
    cells = [[_cell(row[column]) for column in columns] for row in rows]
    numeric = [not isinstance(rows[0][column], str) for column in columns]
    widths = [
        max(3, len(column), *(len(line[n]) for line in cells)) for n, column in enumerate(columns)
    ]

    def line(texts: list[str]) -> str:
        padded = [
            text.rjust(width) if right else text.ljust(width)
            for text, width, right in zip(texts, widths, numeric, strict=True)
        ]
        return f"| {' | '.join(padded)} |"

    rule = [
        "-" * (width - 1) + (":" if right else "-")
        for width, right in zip(widths, numeric, strict=True)
    ]
    return "\n".join(
        [line(columns), f"|{'|'.join(f' {text} ' for text in rule)}|", *map(line, cells)]
    )


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.3g}" if abs(value) < 100 else f"{value:.0f}"
    return "-" if value is None else str(value)


def save(name: str, text: str, data: dict[str, Any], figures: dict[str, Figure]) -> None:
    """Print the text, and write ``name``.md, ``name``.json and the figures into ``RESULTS``."""
    RESULTS.mkdir(parents=True, exist_ok=True)
    print(text)
    (RESULTS / f"{name}.md").write_text(text + "\n", encoding="utf-8")
    content = json.dumps({"machine": machine()} | data, indent=1)
    (RESULTS / f"{name}.json").write_text(content + "\n", encoding="utf-8")
    for figure_name, figure in figures.items():
        figure.savefig(RESULTS / f"{figure_name}.png", dpi=120)
