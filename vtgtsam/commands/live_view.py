# SPDX-License-Identifier: MIT
"""The live page's options, for every command that runs live."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from ..live.view import Where

LOOPBACK, PORT = "127.0.0.1", 9090

View = Annotated[
    bool, typer.Option("--view", help="Serve a live page for a browser, as long as this runs.")
]
ViewHost = Annotated[
    str,
    typer.Option(
        "--view-host",
        help="Address that the page is served at; 0.0.0.0 lets other computers see it.",
    ),
]
ViewPort = Annotated[
    int,
    typer.Option("--view-port", min=1, max=65535, help="Its port; another one if that is taken."),
]


def live_page(
    wanted: bool, host: str, port: int, save: Path | None, say: Callable[[str], None]
) -> Where | None:
    """Where a run is to be shown, checked before anything starts; says where the page will be."""
    if not wanted and save is None:
        return None
    from ..live.page import free_address
    from ..live.view import Where

    where = Where(free_address(host, port) if wanted else None, save)
    where.check()
    if where.page is not None:
        say(f"live page: {where.page.url}")
    return where
