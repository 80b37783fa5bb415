# SPDX-License-Identifier: MIT
"""A YAML file of pads beside a hand's own file, which stays as its maker wrote it.

Every pad is given either by the centre of its contact face, or as a face of a box that is there::

    hand: right_hand.xml            # optional, relative to this file: then this file is the hand
    pads:
      - {name: tip, body: ff_tip, pos: [0.012, 0, 0.02], normal: +x, size: [0.022, 0.016]}
      - {name: palm, body: palm, geom: 0, face: -x}      # the palm's first box, its -x face
      - {name: left, geom: finger_box, face: +z, size: [0.02, 0.01]}   # smaller than the face

``pos`` [m], ``normal`` and ``along`` (which way the first of the two sizes lies) are in the frame of
the body, or of the box where there is one. Sizes are full lengths [m].
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    ValidationError,
    model_validator,
)

from ..exceptions import HandError
from ..input.text import parse_json, read_yaml

THICKNESS = (
    0.002  # [m], of a pad that is given by its face alone; only the simulator and pictures use it
)
SUFFIXES = (".yaml", ".yml")
_AXES = {f"{sign}{axis}" for sign in "+-" for axis in "xyz"}


def _direction(value: Any) -> Any:
    """A signed axis as three numbers; three numbers as they are."""
    if not isinstance(value, str):
        return value
    if value not in _AXES:
        raise ValueError('must be "+x", "-x", ... or three numbers')
    return tuple(float(value[0] + "1") if axis == value[1] else 0.0 for axis in "xyz")


def _not_zero(value: tuple[float, float, float]) -> tuple[float, float, float]:
    if np.linalg.norm(value) < 1e-9:
        raise ValueError("must not be zero")
    return value


def _text(value: Any) -> Any:
    """Names that are numbers are names all the same."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


Name = Annotated[str, BeforeValidator(_text), Field(min_length=1)]
Vector = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
Direction = Annotated[Vector, BeforeValidator(_direction), AfterValidator(_not_zero)]
Side = Annotated[FiniteFloat, Field(gt=0)]


class PadEntry(BaseModel):
    """One pad of a pads file.

    Attributes:
        name: The pad's name.
        body: The body it is fixed to.
        pos: Centre of the contact face in the body's frame [m].
        normal: Out of the pad, in the body's frame.
        size: Length and width of the contact face [m].
        geom: A box of the hand instead: its name, or its number among the body's boxes.
        face: Which of the box's faces touches.
        along: Which way the length lies; by default x, or y where the normal is x.
        thickness: How far the pad reaches below its face [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: Name
    body: Name | None = None
    pos: Vector | None = None
    normal: Direction | None = None
    size: tuple[Side, Side] | None = None
    geom: str | Annotated[int, Field(ge=0)] | None = None
    face: Literal["+x", "-x", "+y", "-y", "+z", "-z"] | None = None
    along: Direction | None = None
    thickness: Side = THICKNESS

    @model_validator(mode="after")
    def _check(self) -> PadEntry:
        if self.face is not None or self.geom is not None:
            self._check_geom()
        elif missing := [n for n in ("body", "pos", "normal", "size") if getattr(self, n) is None]:
            raise ValueError(
                f"pad {self.name!r} lacks {', '.join(missing)}; a pad needs body, pos, normal and size, or "
                "geom and face of a box"
            )
        normal = self.normal or _direction(self.face)
        if self.along is not None:
            cosine = (
                np.dot(normal, self.along) / np.linalg.norm(normal) / np.linalg.norm(self.along)
            )
            if abs(cosine) > 0.99:
                raise ValueError(f"pad {self.name!r}: along must not be the normal's direction")
        return self

    def _check_geom(self) -> None:
        if self.face is None:
            raise ValueError(
                f"pad {self.name!r}: which face of the geom? say face: +z, for example"
            )
        if self.pos is not None or self.normal is not None:
            raise ValueError(
                f"pad {self.name!r} has both a face of a geom and pos or normal; give one or the other"
            )
        if not isinstance(self.geom, str) and self.body is None:
            raise ValueError(
                f"pad {self.name!r}: which geom? give its name, or its body and number"
            )


class PadFile(BaseModel):
    """What a pads file says.

    Attributes:
        hand: Path of the hand's own file, or None.
        pads: The pads, in the order of contact bits.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    hand: str | None = None
    pads: Annotated[tuple[PadEntry, ...], Field(min_length=1)]


def is_pad_file(path: str | Path) -> bool:
    """Whether a name is a pads file's: it ends in .yaml or .yml."""
    return Path(path).suffix.lower() in SUFFIXES


def read_pad_file(path: str | Path) -> PadFile:
    """Read a pads file; the hand it names is relative to it.

    Raises:
        HandError: It cannot be read or says something that is not understood.
    """
    path = Path(path)
    content = read_yaml(path, HandError, "the pads file ")
    if not isinstance(content, dict) or "pads" not in content:
        raise HandError(
            f"the pads file {path} must have an entry 'pads', a list; docs/pads.md shows one"
        )
    try:
        file = PadFile.model_validate(content)
    except ValidationError as error:
        raise HandError(f"the pads file {path}: {_sentence(error)}") from None
    if file.hand is None:
        return file
    return file.model_copy(update={"hand": str(path.parent / Path(file.hand).expanduser())})


def entries_text(entries: Sequence[PadEntry]) -> str:
    """Entries as one line of text, which ``entries_from_text`` takes back bit by bit."""
    return json.dumps([entry.model_dump(exclude_defaults=True) for entry in entries])


def is_entries(text: str) -> bool:
    """Whether a text is a pads file's entries and not a pattern of names."""
    return text.startswith("[{")


def entries_from_text(text: str) -> tuple[PadEntry, ...]:
    """Entries from the text that ``entries_text`` made.

    Raises:
        HandError: It is not such a text.
    """
    try:
        return PadFile.model_validate({"pads": parse_json(text, "the list", HandError)}).pads
    except (ValueError, RecursionError) as error:
        raise HandError(f"the list of pads in the hand's text is damaged: {error}") from None


def _sentence(error: ValidationError) -> str:
    """The first problem, in words."""
    problem = error.errors()[0]
    place = ".".join(str(part) for part in problem["loc"]) or "the file"
    if problem["type"] == "extra_forbidden":
        return f"unknown entry '{place}'; remove it or correct its name"
    if problem["type"] == "missing":
        return f"the entry '{place}' is missing"
    message = problem["msg"].removeprefix("Value error, ")
    if message.startswith("pad "):  # it names the pad itself
        return message
    return f"'{place}': {message[0].lower()}{message[1:]}, got {problem['input']!r}"
