# SPDX-License-Identifier: MIT
"""The page as people see it, in a real browser without a window."""

import pytest
from browsers import browser as browser


@pytest.fixture(scope="module")
def opened(browser, reported):
    """The page, what it said on the console, and what it asked for."""
    page = browser.new_page()
    said, asked = [], []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("request", lambda request: asked.append(request.url))
    page.goto((reported / "report.html").as_uri())
    page.wait_for_load_state("networkidle")
    return page, said, asked


def test_no_error_and_nothing_from_elsewhere(opened, reported):
    _, said, asked = opened
    assert said == []
    asked = [url for url in asked if not url.startswith("data:")]
    assert asked == [(reported / "report.html").as_uri()]


def test_all_images_are_drawn(opened, reported):
    page, *_ = opened
    sizes = page.eval_on_selector_all("img", "all => all.map(i => [i.naturalWidth, i.clientWidth])")
    assert len(sizes) == len(list((reported / "figures").glob("*.png")))
    assert all(natural > 300 and shown > 200 for natural, shown in sizes)


@pytest.mark.parametrize("width", [375, 1600])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_page_is_as_wide_as_the_screen(opened, width, scheme):
    page, *_ = opened
    page.emulate_media(color_scheme=scheme)
    page.set_viewport_size({"width": width, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") == width
    dark = page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(23, 24, 26)"
    assert dark == (scheme == "dark")


def column(page, title):
    """Cells of a column of the table of methods, from top to bottom."""
    heads = page.locator("#methods-table th").all_inner_texts()
    (index,) = (i for i, head in enumerate(heads) if head.startswith(title))
    return page.locator(f"#methods-table td:nth-child({index + 1})").all_inner_texts()


def test_a_click_on_a_title_sorts_and_another_one_turns_it_round(opened):
    page, *_ = opened
    head = page.locator("#methods-table th", has_text="ADD [mm]")
    before = [float(text) for text in column(page, "ADD [mm]")]
    assert before != sorted(before)
    head.get_by_role("button").click()
    assert [float(text) for text in column(page, "ADD [mm]")] == sorted(before)
    assert head.get_attribute("aria-sort") == "ascending"
    head.get_by_role("button").click()
    assert [float(text) for text in column(page, "ADD [mm]")] == sorted(before, reverse=True)
    assert head.get_attribute("aria-sort") == "descending"


def test_small_p_values_are_sorted_as_numbers(opened):
    page, *_ = opened
    page.locator("#tests-table th").get_by_role("button", name="p (Holm)").click()
    cells = page.locator("#tests-table td:nth-last-child(3)")
    keys = [float(key) for key in cells.evaluate_all("all => all.map(c => c.dataset.key)")]
    assert len(keys) == 18
    assert keys == sorted(keys)
    assert keys[0] < keys[-1]


def test_what_is_typed_leaves_only_rows_that_hold_it(opened):
    page, *_ = opened
    field = page.locator("[data-filters=methods-table]")
    field.fill("vis+pen after")
    visible = page.locator("#methods-table tbody tr:visible").all_inner_texts()
    assert len(visible) == 2
    assert all("vis+pen" in row and "after the turn" in row for row in visible)
    assert page.locator("#methods output").inner_text() == "2 of 18 rows"
    field.fill("")
    assert page.locator("#methods-table tbody tr:visible").count() == 18
