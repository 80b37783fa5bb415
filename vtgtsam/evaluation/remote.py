# SPDX-License-Identifier: MIT
"""Recordings at a URL, as in an object store: listed once, fetched one at a time (through fsspec)."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..exceptions import RecordingError, VtgtsamError
from ..extras import require

# What stores call the mark of a file's content, the best first, in small letters without "_" and "-".
_MARKS = ("etag", "md5hash", "contentmd5", "mtime", "lastmodified", "updated")


@dataclass(frozen=True)
class RemoteFile:
    """One file of a recording.

    Attributes:
        path: Its path in the store.
        size: [bytes], None where the store does not say.
        mark: What changes with its content, as the store tells it unread; None where it does not.
    """

    path: str
    size: int | None
    mark: str | None

    @property
    def name(self) -> str:
        """The last part of its path."""
        return self.path.rpartition("/")[2]


@dataclass(frozen=True)
class RemoteRecording:
    """An ``.mcap`` file or a rosbag2 folder in a store.

    Attributes:
        url: Its own URL.
        given: The URL that it was found under. Whoever fetches it opens the store by this, with the
            credentials of the own process.
        files: The file, or all that lie in the folder.
        is_folder: Whether it is a folder.
    """

    url: str
    given: str = field(compare=False)
    files: tuple[RemoteFile, ...]
    is_folder: bool

    def __str__(self) -> str:
        return self.url

    def resolve(self) -> RemoteRecording:
        """Itself: where a path is made absolute, a URL is so already."""
        return self

    def version(self) -> str:
        """What differs where the content may: the store's marks; a file without one is read."""
        return json.dumps([self.url, *(file.mark or self._hash(file) for file in self.files)])

    @contextmanager
    def fetched(self) -> Iterator[Path]:
        """A copy in the folder for temporary files (``TMPDIR``), removed in the end and after an error.

        Raises:
            RecordingError: It cannot be fetched.
        """
        with TemporaryDirectory(prefix="vtgtsam-") as folder:
            copy = Path(folder) / self.url.rpartition("/")[2]
            self._fetch(copy)
            try:
                yield copy
            except VtgtsamError as error:
                raise type(error)(str(error).replace(str(copy), self.url)) from error

    def _fetch(self, copy: Path) -> None:
        store, _ = _open(self.given)
        if self.is_folder:
            copy.mkdir()
        for file in self.files:
            to = copy / file.name if self.is_folder else copy
            with _told(f"{self.url} cannot be fetched"):
                store.get_file(file.path, str(to))
            size = to.stat().st_size
            if file.size not in (
                None,
                size,
            ):  # else it would pass for a recording cut off by a crash
                raise RecordingError(
                    f"{self.url} changed while it was fetched: {file.name} was listed with "
                    f"{file.size} bytes and came with {size}; call again when it is complete"
                )

    def _hash(self, file: RemoteFile) -> str:
        store, _ = _open(self.given)
        with _told(f"{self.url} cannot be read"), store.open(file.path, "rb") as stream:
            digest = hashlib.sha256()
            while block := stream.read(1 << 20):
                digest.update(block)
        return digest.hexdigest()


def is_url(path: str | os.PathLike[str]) -> bool:
    """Whether it is a URL, such as "s3://bucket/folder", and no path."""
    return "://" in str(path)


def find_remote(url: str) -> Iterator[tuple[str, RemoteRecording]]:
    """Recordings at a URL, each with the parts of its path below it; its own name where it is one.

    Raises:
        RecordingError: The store cannot be listed, or holds no recording there.
    """
    store, root = _open(url)
    root = root.rstrip("/")
    with _told(f"{url} cannot be listed"):
        store.invalidate_cache()
        listed = store.find(root, detail=True)
        exists = bool(listed) or store.exists(root)
    if not exists:
        raise RecordingError(f"{url} does not exist")
    found = _recordings(root, [_file(path, info) for path, info in sorted(listed.items())])
    if not found:
        raise RecordingError(
            f"no recordings at {url}; expected .mcap files or rosbag2 folders below it"
        )
    for path, files in found.items():
        below = path.removeprefix(root).strip("/") or root.rpartition("/")[2]
        own = str(store.unstrip_protocol(path))
        is_folder = files[0].path != path
        yield below, RemoteRecording(own, url, tuple(files), is_folder)


def _recordings(root: str, files: list[RemoteFile]) -> dict[str, list[RemoteFile]]:
    """Files of each recording by its path, with the same rules as for folders on disk."""
    bags = {file.path.rpartition("/")[0] for file in files if file.name == "metadata.yaml"}
    found: dict[str, list[RemoteFile]] = {}
    for file in files:
        above = [folder for folder in _folders(root, file.path) if folder in bags]
        if file.path == root or (file.name.endswith(".mcap") and not above):
            found[file.path] = [file]
        elif above and file.path == f"{above[0]}/{file.name}":  # the outermost; bags are flat
            found.setdefault(above[0], []).append(file)
    return found


def _folders(root: str, path: str) -> list[str]:
    """Folders that a file lies in, from ``root`` inwards."""
    inner = path.removeprefix(root).split("/")[1:-1]
    return [root, *("/".join([root, *inner[: i + 1]]) for i in range(len(inner)))]


def _file(path: str, info: Mapping[str, Any]) -> RemoteFile:
    said = {name.lower().replace("_", "").replace("-", ""): info[name] for name in info}
    mark = next((f"{said[name]} {said.get('size')}" for name in _MARKS if said.get(name)), None)
    return RemoteFile(path, said.get("size"), mark)


def _open(url: str) -> tuple[Any, str]:
    """The store that a URL lies in, and the path there."""
    require("cluster", f"{url} needs", "fsspec")
    from fsspec.core import url_to_fs

    with _told(f"{url} cannot be opened"):
        try:
            store, path = url_to_fs(url)
        except ImportError as error:  # its sentence names the package
            raise RecordingError(f"{url} needs another package: {error}") from error
    return store, str(path)


@contextmanager
def _told(problem: str) -> Iterator[None]:
    try:
        yield
    except RecordingError:
        raise
    except Exception as error:  # every store's package has its own kinds
        raise RecordingError(f"{problem} ({type(error).__name__}: {error})") from error
