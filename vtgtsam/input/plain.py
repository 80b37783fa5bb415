# SPDX-License-Identifier: MIT
"""Text from a file, shown so that it can be told from ours: one line, nothing that moves a terminal's cursor."""

from __future__ import annotations

LONGEST = 300  # [characters] of it that are shown


def plain(text: object, longest: int = LONGEST) -> str:
    r"""The text on one line, with what cannot be seen written as in ``"\x1b"``, and cut where it is long."""
    line = "".join(c if c.isprintable() else _escaped(c) for c in str(text)[: longest + 1])
    return line if len(line) <= longest else line[:longest] + "..."


def sentence(text: object) -> str:
    """A message of ours on one line; what it quotes cannot start another one."""
    return "".join(c if c.isprintable() else _escaped(c) for c in " ".join(str(text).split()))


def _escaped(character: str) -> str:
    return character.encode("unicode_escape").decode()
