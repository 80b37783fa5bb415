# SPDX-License-Identifier: MIT
"""The tables and the picture of what calibrating brings, from a row for each judged recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .report import table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LIMIT = "true offsets"  # in the place of a number of grasps
ONLINE = "while it works"
COLORS = {"vis": "#999999", "vis+tac+pen": "#E69F00", "vis+tac+pen+mem": "#0072B2"}


def tables(found: Sequence[dict[str, Any]]) -> tuple[list[dict[str, Any]], str]:
    """The rows of the table of errors, and both tables as text."""
    errors = [
        _errors_row(has, method, grasps, rows)
        for (has, method, grasps), rows in _grouped(found, "robot has", "method", "grasps")
    ]
    _put_limits_beside(errors)
    calibrated = [row for row in found if "nees" in row]
    offsets = [
        _offsets_row(has, grasps, rows)
        for (has, grasps), rows in _grouped(calibrated, "robot has", "grasps")
    ]
    text = table(errors)
    if offsets:
        text += f"\n\nThe offsets, 6 of the camera and one a joint:\n\n{table(offsets)}"
    return errors, text


def _grouped(
    rows: Sequence[dict[str, Any]], *columns: str
) -> Iterator[tuple[tuple[Any, ...], list[dict[str, Any]]]]:
    """Rows by the values of some columns, in the order in which these come."""
    groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(tuple(row[column] for column in columns), []).append(row)
    yield from sorted(groups.items(), key=lambda item: [str(part).zfill(20) for part in item[0]])


def _errors_row(has: str, method: str, grasps: Any, rows: list[dict[str, Any]]) -> dict[str, Any]:
    errors = 1e3 * np.array([row["adds_m"] for row in rows])
    return {
        "robot has": has,
        "method": method,
        "earlier grasps": str(grasps),
        "median": float(np.median(errors)),
        "90 %": float(np.quantile(errors, 0.9)),
        "worst": float(errors.max()),
        "frames > 5 mm [%]": 100 * float(np.mean([row["far"] for row in rows])),
        "in the 95 % region [%]": 100 * float(np.mean([row["covered"] for row in rows])),
        "recordings": len(rows),
    }


def _put_limits_beside(rows: list[dict[str, Any]]) -> None:
    """Give each row the median and 90th percentile that its method has with the true offsets; NaN where unknown."""
    limits = {
        (row["robot has"], row["method"]): row for row in rows if row["earlier grasps"] == LIMIT
    }
    for row in rows:
        limit = limits.get((row["robot has"], row["method"]), {})
        row["limit"] = limit.get("median", float("nan"))
        row["limit 90 %"] = limit.get("90 %", float("nan"))


def _offsets_row(has: str, grasps: Any, rows: list[dict[str, Any]]) -> dict[str, Any]:
    def mean(name: str, scale: float = 1.0) -> float:
        return scale * float(np.sqrt(np.mean(np.square([row[name] for row in rows]))))

    return {
        "robot has": has,
        "grasps": str(grasps),
        "NEES": float(np.mean([row["nees"] for row in rows])),
        "largest NEES": float(np.max([row["nees"] for row in rows])),
        "joint zeros [deg]": mean("joints_rad", float(np.degrees(1.0))),
        "camera turn [deg]": mean("camera_rad", float(np.degrees(1.0))),
        "camera [mm]": mean("camera_m", 1e3),
        "left out": sum(len(row["left_out"]) for row in rows),
        "processor time [s]": float(np.median([row["seconds"] for row in rows])),
    }


def figure(rows: Sequence[dict[str, Any]]) -> Figure:
    """The error against the number of grasps: median and 90th percentile of each method."""
    from matplotlib.figure import Figure

    picture = Figure(figsize=(7, 4), layout="constrained")
    axes = picture.subplots()
    imperfect = [row for row in rows if row["robot has"] == "errors"]
    for method, color in COLORS.items():
        chosen = [row for row in imperfect if row["method"] == method]
        points = [row for row in chosen if row["earlier grasps"].isdigit()]
        if not points:
            continue
        counts = [int(row["earlier grasps"]) for row in points]
        axes.plot(counts, [row["median"] for row in points], "o-", color=color, label=method)
        axes.plot(counts, [row["90 %"] for row in points], "--", color=color, linewidth=1)
    _references(axes, imperfect)
    axes.set_ylim(bottom=0)
    axes.set_xlabel("earlier grasps of the same robot")
    axes.set_ylabel("ADD-S after the turn [mm]")
    axes.legend(title="median; dashed: 90 %", fontsize=8)
    axes.spines[["top", "right"]].set_visible(False)
    return picture


def _references(axes: Any, rows: Sequence[dict[str, Any]]) -> None:
    """What the best method is at with the true offsets, and while it calibrates in its first grasp."""
    best = list(COLORS)[-1]
    for row in rows:
        if row["method"] == best and row["earlier grasps"] == LIMIT:
            axes.axhline(row["median"], color="0.6", linestyle=":", label=LIMIT)
        if row["method"] == best and row["earlier grasps"] == ONLINE:
            axes.plot(0, row["median"], "x", color=COLORS[best], label=ONLINE)
