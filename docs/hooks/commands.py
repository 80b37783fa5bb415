# SPDX-License-Identifier: MIT
"""``{{ help: vtgtsam evaluate }}`` in a page becomes what that command's ``--help`` says."""

import re

_PLACE = re.compile(r"^\{\{ help: vtgtsam(?: (?P<name>[\w-]+))? \}\}$", re.MULTILINE)


def on_page_markdown(markdown, **_):
    """Put the helps in."""
    return _PLACE.sub(lambda match: f"```text\n{_help(match['name'])}\n```", markdown)


def _help(name):
    import click
    import typer

    from vtgtsam.cli import app

    command = typer.main.get_command(app)
    if name is None:
        context = click.Context(command, info_name="vtgtsam", terminal_width=80)
        return command.get_help(context).strip()
    context = click.Context(command.commands[name], info_name=f"vtgtsam {name}", terminal_width=80)
    return command.commands[name].get_help(context).strip()
