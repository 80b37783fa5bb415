# SPDX-License-Identifier: MIT
"""Whoever stands beside the hand and does what it cannot; the run is watched while they do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

# Shows a request and waits until a person has done it, calling the function it is given at least every 0.1 s.
Ask = Callable[[str, Callable[[], None]], object]


@dataclass(frozen=True, eq=False)
class Person:
    """Who is asked.

    Attributes:
        ask: Asks them; None: nobody is asked.
        say: Shows them a line.
        needed: Whether somebody has to do what is asked for; an emulated hand needs nobody.
    """

    ask: Ask | None
    say: Callable[[str], None]
    needed: bool

    def request(self, text: str, watch: Callable[[], None]) -> None:
        """Ask for something; returns when it is done, or at once where nobody is asked.

        Args:
            text: What to do, ending in "press Enter: ".
            watch: Looks after the run meanwhile; raises where it has to end.
        """
        if self.ask is not None:
            self.ask(text, watch)
        elif self.needed:
            self.say(text.removesuffix(", then press Enter: ").removesuffix(" Press Enter: "))
        watch()
