# SPDX-License-Identifier: MIT
"""Formulas and tables of the site as people see them, in a real browser without a window."""

import re

import pytest
from browsers import browser as browser
from test_site import PAGES, ROOT
from test_site import site as site

FORMULAS = re.compile(r"\$\$.*?\$\$|(?<![\\$`])\$[^$`\n]+\$", re.DOTALL)


@pytest.fixture(scope="module")
def page(browser):
    page = browser.new_page()
    page.said = []
    page.on("pageerror", lambda error: page.said.append(str(error)))
    return page


WITH_FORMULAS = [
    p for p in PAGES if FORMULAS.search(re.sub(r"```.*?```", "", p.read_text(), flags=re.DOTALL))
]


@pytest.mark.parametrize("source", WITH_FORMULAS, ids=lambda p: p.stem)
def test_every_formula_is_set_without_an_error(page, site, source):
    page.goto((site / source.relative_to(ROOT / "docs").with_suffix(".html")).as_uri())
    marked = page.locator(".arithmatex").count()
    assert marked > 0
    assert page.locator(".arithmatex > .katex, .arithmatex > .katex-display").count() == marked
    assert page.locator(".katex-error").count() == 0
    assert page.said == []


@pytest.mark.parametrize("width", [390, 1280, 1920])
@pytest.mark.parametrize("name", ["index", "evaluation", "how-to/weights", "explanation/results"])
def test_pages_are_as_wide_as_the_screen(page, site, name, width):
    page.set_viewport_size({"width": width, "height": 900})
    page.goto((site / f"{name}.html").as_uri())
    assert page.evaluate("document.documentElement.scrollWidth") <= width
