# SPDX-License-Identifier: MIT
"""``{{ errors }}`` in a page becomes a table of all messages that the package raises, part by part."""

import ast
import re
from pathlib import Path

_PLACE = "{{ errors }}"
_PACKAGE = Path(__file__).parents[2] / "vtgtsam"
_FEWEST_WORDS = 3  # shorter ones are for programs, not for people


def on_page_markdown(markdown, **_):
    """Put the tables in."""
    return markdown.replace(_PLACE, _tables()) if _PLACE in markdown else markdown


def _tables():
    parts = {}
    for path in sorted(_PACKAGE.rglob("*.py")):
        part = path.relative_to(_PACKAGE).parts[0].removesuffix(".py")
        for kind, message in messages(path.read_text(encoding="utf-8")):
            parts.setdefault(part, {})[message] = kind
    return "\n".join(_table(part, found) for part, found in parts.items())


def _table(part, found):
    rows = [f"| {_escaped(message)} | `{kind}` |" for message, kind in sorted(found.items())]
    return "\n".join([f"## vtgtsam.{part}\n", "| message | |", "|---|---|", *rows, ""])


def messages(source):
    """Kind and text of each exception that a program raises with words of its own."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and node.args:
            name = getattr(node.func, "id", getattr(node.func, "attr", ""))
            text = _text(node.args[0])
            if name.endswith(("Error", "Exit", "BadParameter", "NoGraphics")) and text:
                if len(re.findall(r"\w+", text)) >= _FEWEST_WORDS:
                    yield name, text


def _text(node):
    """The words of a string, what is filled in as an ellipsis; empty where it is none."""
    if isinstance(node, ast.Constant):
        return " ".join(node.value.split()) if isinstance(node.value, str) else ""
    if isinstance(node, ast.JoinedStr):
        parts = [v.value if isinstance(v, ast.Constant) else "…" for v in node.values]
        return " ".join("".join(parts).split())
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        left, right = _text(node.left), _text(node.right)
        return f"{left or '…'}{right or '…'}" if left or right else ""
    return ""


def _escaped(text):
    return re.sub(r"([|<>*_`\[\]{}\\])", r"\\\1", text)
