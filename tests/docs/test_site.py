# SPDX-License-Identifier: MIT
"""The documentation's site builds without a warning, needs no network, and says what is true."""

import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted((ROOT / "docs").rglob("*.md"))
READMES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(ROOT.glob("*/README.md"))]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    if find_spec("mkdocs") is None:
        pytest.skip("the site needs the extra docs, which is not installed")
    folder = tmp_path_factory.mktemp("site")
    build = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)],
        cwd=ROOT,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert build.returncode == 0, build.stderr
    assert "WARNING" not in build.stdout + build.stderr
    return folder


def test_every_help_and_every_error_is_filled_in(site):
    for page in site.rglob("*.html"):
        text = page.read_text()
        assert "{{ help" not in text and "{{ errors" not in text, page
    commands = (site / "reference" / "command-line.html").read_text()
    assert "--topics" in commands and "--estimates" in commands
    errors = (site / "reference" / "errors.html").read_text()
    assert errors.count("<h4") > 300
    assert (
        'id="contacts-inverted"' in errors
        and "sign" in errors.split('id="contacts-inverted"')[1][:600]
    )
    assert "is no calibration: expected a mapping, got" in errors


def test_every_command_has_its_help_in_the_reference():
    import typer

    from vtgtsam.cli import app

    text = (ROOT / "docs" / "reference" / "command-line.md").read_text()
    for name in typer.main.get_command(app).commands:
        assert f"{{{{ help: vtgtsam {name} }}}}" in text


def test_nothing_is_fetched_from_the_network(site):
    for page in site.rglob("*.html"):
        text = page.read_text()
        fetched = re.findall(r'<(?:script|img|link|iframe)[^>]*(?:src|href)="(https?:[^"]*)"', text)
        assert fetched == [], page
        assert "unpkg.com" not in text


def test_the_reference_has_every_public_name(site):
    import vtgtsam

    text = "".join(page.read_text() for page in (site / "reference").glob("*.html"))
    names = [name for name in vtgtsam.__all__ if name != "__version__"]
    missing = [n for n in names if not re.search(rf'id="vtgtsam\.[\w.]*\b{n}"', text)]
    assert missing == []


def _blocks(language):
    for page in [*PAGES, *READMES]:
        for block in re.findall(rf"```{language}\n(.*?)```", page.read_text(), flags=re.DOTALL):
            yield page, block


def _command_lines():
    """Lines of the pages that someone would type, in fences or indented, without comments."""
    for page in [*PAGES, *READMES]:
        text = re.sub(r"\\\n\s*", "", page.read_text())
        fenced = re.findall(r"```sh\n(.*?)```", text, flags=re.DOTALL)
        indented = re.findall(
            r"^ {4}(\S.*)$", re.sub(r"```.*?```", "", text, flags=re.DOTALL), re.MULTILINE
        )
        for line in [*"\n".join(fenced).splitlines(), *indented]:
            yield page, re.sub(r"\s+#.*", "", line).split(" | ")[0].strip()


def test_every_command_line_in_the_pages_has_options_that_exist():
    import importlib

    import typer

    known = {
        package: typer.main.get_command(importlib.import_module(module).app).commands
        for package, module in [
            ("vtgtsam", "vtgtsam.cli"),
            *((name, f"{name}.__main__") for name in ("sim", "hardware", "benchmarks")),
        ]
    }
    seen = dict.fromkeys(known, 0)
    for page, line in _command_lines():
        words = line.removeprefix("python -m ").split()
        if words[:1] == ["vtgtsam"] or line.startswith("python -m ") and words[0] in known:
            package, name, *arguments = words
            if name.startswith("-"):
                continue
            assert name in known[package], (page, line)
            command = known[package][name]
            context = command.context_class(command, info_name=name)
            command.make_parser(context).parse_args(arguments)  # raises where an option is wrong
            seen[package] += 1
    assert min(seen.values()) > 5, seen


def test_every_make_target_in_the_pages_exists():
    makefile = (ROOT / "Makefile").read_text()
    targets = [(page, line) for page, line in _command_lines() if re.match(r"make [a-z]", line)]
    for page, line in targets:
        for target in re.findall(
            r"\b(?<!=)[a-z][a-z-]+\b(?!=)", line.removeprefix("make ").split("=")[0]
        ):
            assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE), (page, line)
    assert len(targets) > 10


def test_python_in_pages_is_python():
    for page, block in _blocks("python"):
        compile(block, str(page), "exec")
