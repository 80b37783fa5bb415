# SPDX-License-Identifier: MIT
"""Where a scene goes: a file, a viewer started for it, a viewer that runs already."""

from __future__ import annotations

import errno
import os
import socket
import sys
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from ..exceptions import VtgtsamError

APPLICATION = "vtgtsam"
ROOM = 1 << 20  # bytes that the beginning of a file needs at most
MEMORY = (
    "25%"  # of the computer's; a viewer keeps what it is sent until then, by default up to 75 %
)


def open_stream(
    name: str,
    layout: rrb.Blueprint,
    save: Path | None = None,
    spawn: bool = False,
    connect: str | None = None,
) -> rr.RecordingStream:
    """A stream to one or several places.

    Args:
        name: What the viewer calls it.
        layout: How the viewer arranges it.
        save: File to write, .rrd.
        spawn: Whether to start a viewer, which stays open after this program has ended.
        connect: Address of a viewer that runs, "rerun+http://HOST:PORT/proxy".

    Raises:
        VtgtsamError: The file cannot be written, or there is no display.
    """
    sinks: list[rr.FileSink | rr.GrpcSink] = []
    if save is not None:
        _check_opens(save)
        sinks.append(rr.FileSink(save))
    if connect is not None:
        sinks.append(rr.GrpcSink(connect))
    stream = rr.RecordingStream(APPLICATION)
    if spawn:
        check_display()
        port = _free_port()  # at the usual one, a viewer of yesterday would be used again
        stream.spawn(port=port, connect=False, memory_limit=MEMORY, hide_welcome_screen=True)
        sinks.append(rr.GrpcSink(f"rerun+http://127.0.0.1:{port}/proxy"))
    stream.set_sinks(*sinks, default_blueprint=layout)
    stream.send_recording_name(name)
    return stream


def check_display() -> None:
    """Refuse to open a window where there is no screen.

    Raises:
        VtgtsamError: Neither X11 nor Wayland is there.
    """
    if sys.platform == "linux" and not (
        os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    ):
        raise VtgtsamError(
            "there is no display to open the viewer on; write a file with --save FILE.rrd and open "
            "it where there is one: rerun FILE.rrd"
        )


def check_name(path: Path) -> None:
    """Refuse a name that Rerun would not open.

    Raises:
        VtgtsamError: It does not end in .rrd.
    """
    if path.suffix != ".rrd":
        raise VtgtsamError(f"Rerun's files are called .rrd, got {path.name!r}")


def check_writable(path: Path) -> None:
    """Refuse a file that cannot be written; creates it.

    Raises:
        VtgtsamError: Its name does not end in .rrd, or its folder does not let it be written.
    """
    check_name(path)
    _check_opens(path)


def _check_opens(path: Path) -> None:
    """Empty the file, and try whether there is room: Rerun waits for ever where its first bytes find none."""
    try:
        with path.open("wb", buffering=0) as file:
            if file.write(bytes(ROOM)) < ROOM:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            file.truncate(0)
    except OSError as error:
        raise VtgtsamError(f"cannot write {path}: {error.strerror}") from None


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
