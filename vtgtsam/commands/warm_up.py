# SPDX-License-Identifier: MIT
"""``vtgtsam warm-up``: compile everything once."""

from __future__ import annotations

import time

import typer


def warm_up() -> None:
    """Compile everything for this machine once, so that no first pose waits for it: for container images."""
    from ..warm_up import warm_up as run

    start = time.monotonic()
    run(lambda part: typer.echo(f"compiling {part}"))
    typer.echo(f"done in {time.monotonic() - start:.0f} s; the machine code is kept for next time")
