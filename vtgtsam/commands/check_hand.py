# SPDX-License-Identifier: MIT
"""``vtgtsam check-hand`` and ``vtgtsam suggest-pads``: a hand's description looked over, and begun."""

from __future__ import annotations

import contextlib
import logging
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import typer

from .options import Force, refuse_existing

PROBLEMS = 1

_FORMATS = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".webp": "WebP"}

HandFile = Annotated[
    str, typer.Argument(metavar="HAND", help="The name isyhand, or an MJCF, URDF or pads file.")
]


def check_hand(
    hand: HandFile,
    out: Annotated[Path, typer.Option(help="Picture to write (.png).")],
    pads: Annotated[
        str | None,
        typer.Option(help="YAML file of pads, or which boxes are pads, like 'taxel_*'."),
    ] = None,
    force: Force = False,
) -> None:
    """Look a hand over: joints, ranges, pads, normals, places, with a picture of them.

    The exit code is 1 where there is a problem; notes are none.
    """
    from ..atomic import replacing
    from ..exceptions import HandError
    from ..hands.check import check_hand as check
    from ..hands.model import HandModel, load_hand
    from ..hands.picture import hand_picture

    refuse_existing(out, force)
    if out.suffix.lower() not in _FORMATS:
        raise HandError(f"{out}: pictures are written as .png, .jpg or .webp")
    if pads is not None and not Path(hand).is_file():
        raise HandError(f"--pads needs the hand's file; there is no file {hand!r}")
    with _unlogged():
        model = load_hand(hand) if pads is None else HandModel.from_mjcf(hand, pads=pads)
    report = check(model)
    typer.echo(str(report))
    with replacing(out) as temporary:
        hand_picture(model).save(temporary, format=_FORMATS[out.suffix.lower()])
    typer.echo(f"{out}: {len(model.pads)} pads and their normals, to be looked at")
    if report.problems:
        raise typer.Exit(PROBLEMS)


@contextlib.contextmanager
def _unlogged() -> Iterator[None]:
    """What is logged of a hand's pads stands in the report too."""
    logger = logging.getLogger("vtgtsam.hands.model")
    before = logger.level
    logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        logger.setLevel(before)


def suggest_pads(
    hand: Annotated[Path, typer.Argument(help="The hand's MJCF or URDF file.")],
    out: Annotated[Path, typer.Option(help="Pads file to write (.yaml).")],
    force: Force = False,
) -> None:
    """Propose pads for a hand that has none: on the palm side of each link that bends."""
    from ..atomic import write_text
    from ..exceptions import HandError
    from ..hands.pad_file import is_pad_file
    from ..hands.suggest import pads_yaml
    from ..hands.suggest import suggest_pads as suggest

    if not is_pad_file(out):
        raise HandError(f"{out}: a pads file ends in .yaml")
    refuse_existing(out, force)
    entries = suggest(hand)
    named = os.path.relpath(hand.resolve(), out.resolve().parent)
    write_text(out, pads_yaml(entries, named))
    typer.echo(
        f"{out}: {len(entries)} pads proposed; look at them: vtgtsam check-hand {out} --out hand.png"
    )
