# SPDX-License-Identifier: MIT
"""The live page: Rerun's web viewer and the server that it gets its data from, for as long as a run goes on."""

from __future__ import annotations

import ctypes
import importlib.util
import signal
import socket
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any
from urllib.parse import quote

from ..commands.live_view import LOOPBACK, PORT
from ..exceptions import VtgtsamError

MEMORY = "500MB"  # of data that the server keeps for pages opened later; then the oldest go
_START = 20.0  # [s]


@dataclass(frozen=True)
class Address:
    """Where the page is.

    Attributes:
        host: The address it listens at; only this computer's own programs reach 127.0.0.1.
        page: Port of the page.
        data: Port of its data.
    """

    host: str
    page: int
    data: int

    @property
    def sink(self) -> str:
        """What a stream of data connects to."""
        return f"rerun+http://{_reached(self.host)}:{self.data}/proxy"

    @property
    def url(self) -> str:
        """What a browser opens."""
        return f"http://{_reached(self.host)}:{self.page}/?url={quote(self.sink, safe='')}"


def _reached(host: str) -> str:
    """How this computer reaches an address that it listens at."""
    return LOOPBACK if host in ("0.0.0.0", "::") else host


def free_address(host: str = LOOPBACK, port: int = PORT) -> Address:
    """An address whose ports are free; the page has ``port`` if that is.

    Raises:
        VtgtsamError: This computer does not have that address.
    """
    try:
        page = port if _is_free(host, port) else _free_port(host)
        return Address(host, page, _free_port(host))
    except OSError as error:
        raise VtgtsamError(
            f"cannot listen at {host!r}: {error.strerror or error}; {LOOPBACK} is this computer alone"
        ) from None


def _is_free(host: str, port: int) -> bool:
    with socket.socket(_family(host)) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            if isinstance(error, socket.gaierror):
                raise
            return False
    return True


def _free_port(host: str) -> int:
    with socket.socket(_family(host)) as probe:
        probe.bind((host, 0))
        return int(probe.getsockname()[1])


def _family(host: str) -> socket.AddressFamily:
    return socket.AF_INET6 if ":" in host else socket.AF_INET


class PageServer:
    """Rerun's server; a context manager, which ends it on the way out.

    Args:
        address: Where it listens.
    """

    def __init__(self, address: Address) -> None:
        self._address = address
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> PageServer:
        a = self._address
        self._process = subprocess.Popen(
            [str(_rerun()), "--serve-web", "--bind", a.host, "--port", str(a.data)]
            + ["--web-viewer-port", str(a.page), "--memory-limit", MEMORY],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C is for the run, which then ends this
            preexec_fn=_end_with_parent,
        )
        end = time.monotonic() + _START
        while time.monotonic() < end and self._process.poll() is None:
            if not (_is_free(a.host, a.page) or _is_free(a.host, a.data)):
                break
            time.sleep(0.05)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._process is None:
            return
        self._process.terminate()
        try:
            self._process.wait(5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def _libc() -> Any:
    return ctypes.CDLL(None) if sys.platform == "linux" else None


_LIBC = _libc()  # before the fork
_PR_SET_PDEATHSIG = 1


def _end_with_parent() -> None:
    """Even one that is killed leaves no server behind, on Linux."""
    if _LIBC is not None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


def _rerun() -> Path:
    """Rerun's program, which its package brings; not the script of that name, which would start it as its child."""
    found = importlib.util.find_spec("rerun_cli")
    folder = Path(found.origin).parent if found is not None and found.origin else Path()
    return folder / ("rerun.exe" if sys.platform == "win32" else "rerun")


def check_page() -> None:
    """Refuse to begin where the page cannot be served.

    Raises:
        VtgtsamError: Rerun is not installed.
    """
    if not _rerun().is_absolute() or not _rerun().is_file():
        raise VtgtsamError("the live page needs Rerun: pip install 'vtgtsam[viz]'")
