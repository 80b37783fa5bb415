# SPDX-License-Identifier: MIT
"""YAML and JSON from files that may hold anything."""

from __future__ import annotations

import json
import stat
from pathlib import Path
from typing import Any

import yaml

from .. import limits
from ..exceptions import VtgtsamError

_LARGEST_INTEGER = 10**300  # a floating-point number ends at 1.8e308


def read_bytes(
    path: Path, limit: float, error: type[VtgtsamError] = VtgtsamError, what: str = ""
) -> bytes:
    """A file's content.

    Args:
        path: The file.
        limit: Bytes that it may have, one of ``limits``.
        error: Kind of the error.
        what: What it is, as in "the topic map ", for messages.

    Raises:
        VtgtsamError: It cannot be read, is too long, or is no file but a pipe or a device, which may never end.
    """
    try:
        about = path.stat()
        if not stat.S_ISREG(about.st_mode):
            kind = "a folder" if stat.S_ISDIR(about.st_mode) else "no regular file"
            raise error(f"{what}{path} is {kind}; give a file")
        limits.check(about.st_size, limit, f"bytes in {path}", error)
        return path.read_bytes()
    except OSError as problem:
        raise error(f"cannot read {what}{path}: {problem.strerror or problem}") from None


def read_yaml(path: Path, error: type[VtgtsamError] = VtgtsamError, what: str = "") -> Any:
    """The content of a YAML file, made of plain lists, mappings, texts and numbers.

    ``what`` says in messages what the file is, as in "the topic map ".

    Raises:
        VtgtsamError: It cannot be read, is not YAML, or is nested or repeated beyond the limits.
    """
    content = read_bytes(path, limits.TEXT_BYTES, error, what)
    return parse_yaml(content, f"{what}{path}", error)


def parse_yaml(content: bytes | str, name: str, error: type[VtgtsamError] = VtgtsamError) -> Any:
    """As ``read_yaml``, of a text that is called ``name`` in messages."""
    try:
        _check_events(content, name, error)
        return yaml.load(content, Loader=_Loader)
    except VtgtsamError:
        raise
    except Exception as problem:  # yaml's constructors raise anything: KeyError, TypeError, ...
        raise error(f"{name} is not valid YAML: {_one_line(problem)}") from None


def parse_json(content: bytes | str, name: str, error: type[VtgtsamError] = VtgtsamError) -> Any:
    """The content of a JSON text that is called ``name`` in messages.

    Raises:
        VtgtsamError: It is not JSON, or nested beyond the limits.
    """
    limits.check(len(content), limits.TEXT_BYTES, f"characters in {name}", error)
    try:
        return json.loads(content, parse_int=_integer)
    except RecursionError:
        raise error(f"{name} is not usable JSON: it is nested too deeply") from None
    except ValueError as problem:
        raise error(f"{name} is not valid JSON: {_one_line(problem)}") from None


class _Loader(yaml.SafeLoader):
    """Plain YAML whose integers are numbers that one can compute with."""

    def construct_integer(self, node: yaml.ScalarNode) -> int:
        """An integer, no larger than a floating-point number can be."""
        return _checked(int(self.construct_yaml_int(node)))


_Loader.add_constructor("tag:yaml.org,2002:int", _Loader.construct_integer)


def _integer(text: str) -> int:
    return _checked(int(text))


def _checked(number: int) -> int:
    if abs(number) > _LARGEST_INTEGER:
        raise ValueError("it has an integer beyond 1e300, which is no number to compute with")
    return number


def _check_events(content: bytes | str, name: str, error: type[VtgtsamError]) -> None:
    """Refuse what is nested or repeated so much that only a program wrote it to do harm.

    An alias (``*name``) counts as much as what it stands for: a few lines of them stand for gigabytes once they are
    written out in a message.
    """
    sizes: dict[str, int] = {}
    open_nodes: list[tuple[str | None, int]] = []  # anchor, number of items before it
    items = 0
    for event in yaml.parse(content, Loader=yaml.SafeLoader):
        if isinstance(event, yaml.CollectionStartEvent):
            open_nodes.append((event.anchor, items))
            limits.check(len(open_nodes), limits.TEXT_DEPTH, f"nested levels in {name}", error)
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, before = open_nodes.pop()
            if anchor is not None:
                sizes[anchor] = items - before
        elif isinstance(event, yaml.AliasEvent):
            items += sizes.get(event.anchor or "", 0)
        items += 1
        limits.check(items, limits.TEXT_ITEMS, f"items in {name}", error)


def _one_line(problem: Exception) -> str:
    words = " ".join(str(problem).split()) or type(problem).__name__
    return words if len(words) <= 300 else words[:300] + "..."
