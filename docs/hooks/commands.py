# SPDX-License-Identifier: MIT
"""``{{ help: vtgtsam evaluate }}`` in a page becomes what that command's ``--help`` says."""

import re

_PLACE = re.compile(r"^\{\{ help: vtgtsam(?: (?P<name>[\w-]+))? \}\}$", re.MULTILINE)


def on_page_markdown(markdown, **_):
    """Put the helps in."""
    return _PLACE.sub(lambda match: f"```text\n{_help(match['name'])}\n```", markdown)


def _help(name):
    from typer.testing import CliRunner

    from vtgtsam.cli import app

    arguments = [name, "--help"] if name else ["--help"]
    asked = CliRunner().invoke(app, arguments, prog_name="vtgtsam", terminal_width=80)
    if asked.exit_code:
        raise ValueError(f"vtgtsam {' '.join(arguments)} failed: {asked.output}")
    return asked.stdout.strip()
