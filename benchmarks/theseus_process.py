# SPDX-License-Identifier: MIT
"""Theseus as a benchmark solver: a process in an environment of its own, asked over pipes.

Its wheels and GTSAM's want different packages, and two OpenMP runtimes in one process fight. The clock runs in the
other process, around the solver's call alone; this one waits meanwhile.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from .clock import Time
from .problem import Problem
from .solver import Linearised, Solved

ROOT = Path(__file__).resolve().parents[1]


def interpreter() -> Path:
    """The environment's Python, in ``.venv-theseus`` or where VTGTSAM_THESEUS says."""
    return Path(os.environ.get("VTGTSAM_THESEUS", ROOT / ".venv-theseus")) / "bin" / "python"


def absent() -> str:
    """Why Theseus cannot run here, in one sentence; empty where it can."""
    if interpreter().exists():
        return ""
    return (
        f"no Theseus environment at {interpreter().parents[1]}: `make theseus` builds it (1.2 GB)"
    )


class TheseusProcess:
    """A problem's frames solved by Theseus.

    Args:
        problem: The problem.
        name: What the reports call it.
        kind: "tuned" or "autodiff" (see ``theseus_variant`` and ``theseus_autodiff``).
        options: What the solver takes: dtype, device, ...

    Attributes:
        versions: What its environment runs.
    """

    def __init__(self, problem: Problem, name: str, kind: str = "tuned", **options: Any) -> None:
        self.name = name
        self._process = subprocess.Popen(
            [interpreter(), "-W", "ignore", "-m", "benchmarks.theseus_worker"],
            cwd=ROOT,
            env=os.environ | {"OMP_NUM_THREADS": "1"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        assert self._process.stdin is not None and self._process.stdout is not None  # pipes
        self._requests, self._answers = self._process.stdin, self._process.stdout
        with tempfile.TemporaryDirectory() as folder:
            problem.save(f"{folder}/problem.npz")
            self.versions = self._ask("load", path=f"{folder}/problem.npz", kind=kind, **options)

    def solve(self, frame: int, T_start: np.ndarray, batch: int = 1) -> Solved:
        """Solve frames [frame, frame + batch), each from its start, T_start (batch, 4, 4)."""
        answer = self._ask("solve", frame=frame, T_start=T_start[:batch].tolist())
        return Solved(np.array(answer["T_wo"]), Time(**answer["time"]))

    def linearise(self, frame: int, T_wo: np.ndarray) -> Linearised:
        """The frame's objective at T_wo (4, 4)."""
        answer = self._ask("linearise", frame=frame, T_wo=T_wo.tolist())
        return Linearised(
            answer["cost"], np.array(answer["information"]), np.array(answer["gradient"])
        )

    def close(self) -> None:
        """End the process."""
        self._requests.close()
        self._process.wait(timeout=30)
        self._answers.close()

    def _ask(self, call: str, **request: Any) -> dict[str, Any]:
        self._requests.write(json.dumps({"call": call} | request) + "\n")
        self._requests.flush()
        line = self._answers.readline()
        answer = json.loads(line) if line else {"failed": "its process ended"}
        if "failed" in answer:
            self._process.kill()
            raise RuntimeError(f"{self.name} failed: {answer['failed']}")
        return answer


def cuda_device() -> str | None:
    """Name of the CUDA device that Theseus' environment sees, or None."""
    code = "import torch; print(torch.cuda.get_device_name() if torch.cuda.is_available() else '')"
    answer = subprocess.run([interpreter(), "-c", code], capture_output=True, text=True, check=True)
    return answer.stdout.strip() or None
