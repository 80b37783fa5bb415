# SPDX-License-Identifier: MIT
"""``{{ errors }}`` in a page becomes all faults of estimates, and all messages that the package raises."""

import ast
import re
from pathlib import Path

_PLACE = "{{ errors }}"
_FAULTS = "../how-to/faults.md#faults"
_PACKAGE = Path(__file__).parents[2] / "vtgtsam"
_PAGE = Path(__file__).parents[1] / "how-to" / "faults.md"
_FEWEST_WORDS = 3  # shorter ones are for programs, not for people


def on_page_markdown(markdown, **_):
    """Put them in."""
    return markdown.replace(_PLACE, _sections()) if _PLACE in markdown else markdown


def _sections():
    parts = {}
    for path in sorted(_PACKAGE.rglob("*.py")):
        part = path.relative_to(_PACKAGE).parts[0].removesuffix(".py")
        for kind, message in messages(path.read_text(encoding="utf-8")):
            parts.setdefault(part, {})[message] = kind
    faults = [
        f"#### {_escaped(word)}\n\n{remedy}. [When it is named]({_FAULTS})"
        for word, remedy in _remedies().items()
    ]
    return "\n\n".join(
        ["## Faults of an estimate", *faults, *(_section(*part) for part in parts.items())]
    )


def _remedies():
    """What to do about each fault, from the page that explains them."""
    rows = [line.split("|") for line in _PAGE.read_text(encoding="utf-8").splitlines()]
    five = (row for row in rows if len(row) == 6)
    return {
        word: _linked_from_here(row[4].strip())
        for row in five
        for word in re.findall(r"`([^`]+)`", row[1])
        if word in _faults()
    }


def _linked_from_here(text):
    return re.sub(r"\]\(([\w-]+\.md)", r"](../how-to/\1", text)


def _faults():
    from vtgtsam.faults import words

    named = [value for name, value in vars(words).items() if name.isupper()]
    return [*named, words.pad_disagrees("NAME"), words.pad_flickers("NAME")]


def _section(part, found):
    """A heading a message: what is searched for is found by its headings first."""
    messages = (f"#### {_escaped(message)}\n\n`{kind}`" for message, kind in sorted(found.items()))
    return "\n\n".join([f"## vtgtsam.{part}", *messages])


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
