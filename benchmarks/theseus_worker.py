# SPDX-License-Identifier: MIT
"""Solves a problem's frames with Theseus on request: a line of JSON in, a line of JSON out.

Run by ``theseus_process`` in Theseus' own environment. Time is taken here, around the solver's call alone.
"""

from __future__ import annotations

import dataclasses
import json
import platform
import sys
from importlib.metadata import version
from typing import Any

import numpy as np
import torch

from .clock import timed
from .problem import Problem
from .theseus_autodiff import AutodiffSolver
from .theseus_variant import TheseusSolver

KINDS = {"tuned": TheseusSolver, "autodiff": AutodiffSolver}


class Worker:
    """Answers requests; each method is one."""

    def load(self, path: str, kind: str, **options: Any) -> dict[str, Any]:
        """Read a problem and build its solver; says what this environment runs."""
        self.solver = KINDS[kind](Problem.load(path), **options)
        return {
            "python": platform.python_version(),
            "torch": torch.__version__,
            "theseus-ai": version("theseus-ai"),
        }

    def solve(self, frame: int, T_start: list[Any]) -> dict[str, Any]:
        """Solve frames from ``frame`` on, one a start (B, 4, 4)."""
        starts = np.array(T_start)
        inputs = self.solver.inputs(slice(frame, frame + len(starts)), starts)
        time, T_wo = timed(lambda: self.solver.solve(inputs))
        return {"time": dataclasses.asdict(time), "T_wo": T_wo.tolist()}

    def linearise(self, frame: int, T_wo: list[Any]) -> dict[str, Any]:
        """Cost, information and gradient of one frame at a pose (4, 4)."""
        inputs = self.solver.inputs(slice(frame, frame + 1), np.array([T_wo]))
        return {name: array[0].tolist() for name, array in self.solver.linearise(inputs).items()}


def main() -> None:
    """Serve until the input ends."""
    torch.set_num_threads(1)
    answers, sys.stdout = sys.stdout, sys.stderr  # nothing else may print between the answers
    worker = Worker()
    for line in sys.stdin:
        request = json.loads(line)
        try:
            answer = getattr(worker, request.pop("call"))(**request)
        except Exception as error:  # told to the process that asked, which raises it
            answer = {"failed": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    main()
