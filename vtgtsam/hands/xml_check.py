# SPDX-License-Identifier: MIT
"""A hand's description looked over before MuJoCo compiles it: a few words of it can ask for terabytes.

Elements that multiply (``replicate``, ``composite``, ``flexcomp``, ``attach``) are counted as often as they come,
included files belong to it, and a description that a recording brings names no file at all.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from xml.parsers import expat

from .. import limits
from ..exceptions import HandError
from ..input.plain import plain
from ..input.text import read_bytes

_MULTIPLIERS = (
    "replicate",
    "composite",
    "flexcomp",
)  # by their attribute "count", of one to three numbers
_COUNTS = frozenset(  # attributes that say how large something gets
    "count nrow ncol width height nsample dim num resolution params njmax nconmax nstack nuserdata nkey "
    "nuser_body nuser_jnt nuser_geom nuser_site nuser_cam nuser_tendon nuser_actuator nuser_sensor "
    "gridsize nlevel subdivision subgrid".split()
)
_SUFFIXES = {letter: 1024**power for power, letter in enumerate("KMGTPE", start=1)}  # of "memory"
_FOREIGN = ("include", "plugin", "extension", "model")  # elements that bring files or libraries
_DEEPEST_INCLUDE = 20


def check_file(path: Path) -> None:
    """Look over a description that a person gave; it may name other files.

    Raises:
        HandError: It cannot be read, is not XML, or is beyond the limits.
    """
    _Check(path.parent, files=True).content(
        read_bytes(path, limits.XML_BYTES, HandError), str(path)
    )


def check_text(text: str, name: str) -> None:
    """Look over a description that came in a recording; it may name no file.

    Raises:
        HandError: It is not XML, is beyond the limits, or names a file.
    """
    _Check(Path(), files=False).content(text.encode("utf-8", errors="replace"), name)


class _Check:
    """Counts while a parser goes through a file and those it includes."""

    def __init__(self, folder: Path, files: bool) -> None:
        self.folder, self.files = folder, files
        self.bytes = 0
        self.elements = 0.0
        self.models = 0.0  # elements of models that <attach> may repeat
        self.attached = 0.0
        self.including: list[Path] = []
        self.repeats = [1.0]  # how often each open element comes

    def content(self, content: bytes, name: str) -> None:
        self.bytes += len(content)
        limits.check(self.bytes, limits.XML_BYTES, f"bytes in {name}", HandError)
        parser = expat.ParserCreate("utf-8")
        parser.StartElementHandler = lambda tag, attributes: self._start(name, tag, attributes)
        parser.EndElementHandler = lambda tag: self.repeats.pop()
        parser.EntityDeclHandler = lambda *entity: _refuse_entities(name)
        try:
            parser.Parse(content.decode("utf-8", errors="replace"), True)
        except expat.ExpatError as error:
            if error.code == expat.errors.codes[expat.errors.XML_ERROR_MISPLACED_XML_PI]:
                raise HandError(
                    f"{name}, line {error.lineno}: something stands before <?xml ... ?>, which must come first; "
                    "remove it"
                ) from None
            raise HandError(
                f"{name}, line {error.lineno}: not valid XML; look for a tag or a quote that is not closed"
            ) from None

    def _start(self, name: str, tag: str, attributes: dict[str, str]) -> None:
        times = self.repeats[-1]
        self._check_attributes(name, tag, attributes)
        if tag in _MULTIPLIERS:
            times *= max(math.prod(_numbers(attributes.get("count", "1"))), 1.0)
        self.repeats.append(times)
        limits.check(len(self.repeats), limits.XML_DEPTH, f"nested levels in {name}", HandError)
        self.elements += times
        self.attached += times * (tag == "attach")
        total = self.elements + self.attached * self.models
        limits.check(total, limits.XML_ELEMENTS, f"elements in {name}", HandError)
        if self.files and tag in ("include", "model") and attributes.get("file"):
            self._other_file(name, tag, attributes["file"])

    def _other_file(self, name: str, tag: str, file: str) -> None:
        path = self.folder / file
        if not path.exists():
            return  # MuJoCo says it better
        if path in self.including or len(self.including) >= _DEEPEST_INCLUDE:
            raise HandError(f"{name} includes {plain(file)}, which includes itself")
        before = self.elements
        self.including.append(path)
        self.content(read_bytes(path, limits.XML_BYTES, HandError), str(path))
        self.including.pop()
        if tag == "model":
            self.models += self.elements - before

    def _check_attributes(self, name: str, tag: str, attributes: dict[str, str]) -> None:
        if not self.files:
            _refuse_files(name, tag, attributes)
        for attribute, text in attributes.items():
            what = f"{tag} {attribute} in {name}"
            if attribute in _COUNTS or (tag == "numeric" and attribute == "size"):
                numbers = _numbers(text)
                limits.check(max(numbers, default=0), limits.XML_NUMBER, what, HandError)
                cells = math.prod(max(number, 1.0) for number in numbers)
                limits.check(cells, limits.PIXELS, what, HandError)
            elif attribute == "memory":
                limits.check(_memory(text), limits.CHUNK_BYTES, what, HandError)
        cells = math.prod(
            max([1.0, *_numbers(attributes.get(side, "1"))])
            for side in ("nrow", "ncol", "width", "height")
        )
        limits.check(cells, limits.PIXELS, f"cells of {tag} in {name}", HandError)


def _refuse_files(name: str, tag: str, attributes: dict[str, str]) -> None:
    named = [
        text for attribute, text in attributes.items() if attribute.startswith("file") and text
    ]
    if named or tag in _FOREIGN:
        what = plain(named[0]) if named else f"an element <{tag}>"
        raise HandError(
            f"{name} names {what}, and what a recording says opens no file of this machine; "
            "give the hand with hand= (--hand)"
        )


def _refuse_entities(name: str) -> None:
    raise HandError(f"{name} declares entities; write their text in their place")


def _numbers(text: str) -> list[float]:
    """The numbers in an attribute; what is none MuJoCo refuses."""
    found = []
    for word in re.split(r"[\s,]+", text.strip()):
        try:
            found.append(abs(float(word)))
        except ValueError:
            continue
    return [math.inf if math.isnan(number) else number for number in found]


def _memory(text: str) -> float:
    match = re.fullmatch(r"\s*(\d+(?:\.\d+)?)\s*([KMGTPE]?)\w*\s*", text.upper())
    return float(match[1]) * _SUFFIXES.get(match[2], 1) if match else 0.0
