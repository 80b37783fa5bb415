# SPDX-License-Identifier: MIT
"""What all command lines of this repository have in common: plain text, ``-h``, summaries that are not cut off."""

from __future__ import annotations

from typing import Any

import typer
from typer.core import TyperGroup


class WholeSummaries(TyperGroup):
    """Lists each command with the whole first line of its help, where Click would cut it off."""

    def get_command(self, *args: Any, **kwargs: Any) -> Any:
        """The command, with its summary."""
        command = super().get_command(*args, **kwargs)
        if command is not None and command.help and not command.short_help:
            command.short_help = command.help.splitlines()[0]
        return command


def command_line(name: str, completion: bool = False) -> typer.Typer:
    """A command line without commands.

    Args:
        name: What is typed.
        completion: Whether it can be completed by the shell, which works for installed programs only.
    """
    return typer.Typer(
        name=name,
        cls=WholeSummaries,
        no_args_is_help=True,
        add_completion=completion,
        context_settings={"help_option_names": ["-h", "--help"]},
        pretty_exceptions_enable=False,
        rich_markup_mode=None,  # plain text, and rich need not be imported
    )
