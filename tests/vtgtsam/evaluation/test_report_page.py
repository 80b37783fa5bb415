# SPDX-License-Identifier: MIT
import base64
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
import yaml
from made_results import METHODS, rewrite_metrics, write_results

from vtgtsam import EstimatorConfig, extras
from vtgtsam.evaluation import report
from vtgtsam.evaluation.groups import groups
from vtgtsam.evaluation.report import make_report
from vtgtsam.evaluation.report.made import how_made
from vtgtsam.evaluation.report.words import number, p_value, scope, verdict
from vtgtsam.evaluation.tables import make_tables


class Elements(HTMLParser):
    """All elements with their attributes, and the text."""

    def __init__(self, html):
        super().__init__()
        self.found, self.text = [], []
        self.feed(html)

    def handle_starttag(self, tag, attributes):
        self.found.append((tag, dict(attributes)))

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture(scope="module")
def html(reported):
    return (reported / "report.html").read_text()


@pytest.fixture(scope="module")
def elements(html):
    return Elements(html)


def test_the_page_holds_all_it_needs(elements):
    linked = [
        attributes[name]
        for _, attributes in elements.found
        for name in ("src", "href", "action", "srcset")
        if name in attributes
    ]
    assert all(link.startswith(("data:", "#")) for link in linked)
    assert not {tag for tag, _ in elements.found} & {"iframe", "object", "embed", "base"}


def test_links_lead_to_sections(elements):
    ids = [attributes["id"] for _, attributes in elements.found if "id" in attributes]
    assert len(ids) == len(set(ids))
    links = [a["href"][1:] for tag, a in elements.found if tag == "a"]
    assert len(links) == 9
    assert set(links) <= set(ids)


def test_every_figure_is_an_svg_with_a_size_and_an_alternative_text(elements, reported):
    images = [attributes for tag, attributes in elements.found if tag == "img"]
    assert len(images) == len(list((reported / "figures").glob("*.png")))
    for image in images:
        svg = base64.b64decode(image["src"].removeprefix("data:image/svg+xml;base64,"))
        assert ET.fromstring(svg).tag == "{http://www.w3.org/2000/svg}svg"
        assert int(image["width"]) > 300
        assert int(image["height"]) > 150
        assert image["alt"]


def test_no_cell_says_nan(elements):
    text = "".join(elements.text)
    assert not re.search(r"\bnan\b|\bNone\b|\binf\b", text)


def test_the_summary_comes_first_and_says_which_method_is_best(html, reported):
    text = "".join(Elements(html[: html.index("<h2>Dataset vary")]).text).replace("\xa0", " ")
    summary = pd.read_csv(reported / "summary.csv").query(
        "object == 'all' and phase == 'after' and noise_scale == 1"
    )
    median = summary.set_index("method")["adds_median_mm"]
    assert f"vis+tac+pen has the smallest median ADD-S: {number(median['vis+tac+pen'])} mm" in text
    tests = pd.read_csv(reported / "tests.csv").query(
        "comparison == 'vis+tac+pen vs vis' and phase == 'after' and noise_scale == 1"
    )
    p = p_value(tests["p_holm"].iloc[0]).replace("\xa0", " ")
    assert f"after Holm's correction {p}" in text
    assert "At the other noise scales" in text
    assert "1 sequence failed" in text
    assert "it is no recording" in text


def test_how_it_was_made_is_told(html):
    assert "Estimates by vtgtsam 1.2.3+abc." in html
    command = "vtgtsam evaluate RECORDINGS --out DIR --methods vis,vis+pen,vis+tac+pen"
    assert f"{command} --config tuned" in html
    assert "log_theta_vis" in html
    assert "scipy" in html


def test_a_setting_that_is_gone_does_not_keep_an_old_result_from_its_page(tmp_path):
    settings = EstimatorConfig.simulation(method="vis").model_dump(mode="json")
    old = {"version": "0.1.0+0", "methods": {"vis": settings | {"engine": "compiled"}}}
    (tmp_path / "config.yaml").write_text(yaml.safe_dump(old))
    assert how_made(tmp_path).commands[0].endswith("--methods vis --config simulation")
    old["methods"]["vis"]["log_theta_vis"] = 800.0  # refused by now
    (tmp_path / "config.yaml").write_text(yaml.safe_dump(old))
    assert how_made(tmp_path).commands[0].endswith("--config config_of_one_method.yaml")


def test_other_settings_than_a_preset_are_a_file(tmp_path):
    settings = EstimatorConfig.tuned(w_pen=7.0).model_dump(mode="json")
    methods = {"methods": {"vis": settings | {"method": "vis"}}, "hand": "mine.xml"}
    (tmp_path / "config.yaml").write_text(yaml.safe_dump(methods))
    assert (
        how_made(tmp_path)
        .commands[0]
        .endswith("--methods vis --config config_of_one_method.yaml --hand mine.xml")
    )


def test_the_page_is_the_same_every_time(tmp_path):
    out = write_results(tmp_path, objects=["can"])
    pages = [make_report(out, make_tables(out)).read_bytes() for _ in range(2)]
    assert pages[0] == pages[1]


def test_names_from_recordings_are_text_and_not_markup(tmp_path):
    out = write_results(tmp_path, objects=["<b>can</b>"], estimates=False)
    html = make_report(out, make_tables(out)).read_text()
    assert "<b>can" not in html
    assert "&lt;b&gt;can" in html


def test_without_any_truth_the_page_says_so(tmp_path):
    out = write_results(tmp_path, objects=["can"], runs=1)
    rewrite_metrics(out, pd.read_parquet(out / "metrics.parquet").head(0))
    html = make_report(out, make_tables(out)).read_text()
    assert "1 sequence of 1 object estimated; there is no truth to compare with" in html


def verdicts(out):
    (group,) = groups(make_tables(out))
    return [sentence.replace("\xa0", " ") for sentence in verdict(group)], group


def test_with_few_sequences_nothing_is_said_about_chance(tmp_path):
    sentences, group = verdicts(write_results(tmp_path, objects=["can"], runs=2))
    assert (
        sentences[-1] == "With 2 sequences nothing can be said about chance: at least 6 are needed."
    )
    assert scope(group) == "2 sequences of 1 object"


def sentences_of(out, errors_mm):
    """What is said where these are the ADD-S [mm] of each method and sequence."""
    write_results(out, objects=list("abcdefghijklmnopqrst")[: len(errors_mm["vis"])], runs=1)
    metrics = pd.read_parquet(out / "metrics.parquet")
    sequence = metrics["sequence"].rank(method="dense").astype(int) - 1
    pairs = zip(metrics["method"], sequence, strict=True)
    metrics["adds_m"] = [1e-3 * errors_mm[method][n] for method, n in pairs]
    rewrite_metrics(out, metrics)
    return verdicts(out)[0]


def test_a_difference_that_may_be_chance_is_told_from_the_side_that_is_ahead(tmp_path):
    ours = 1.0 + 0.01 * np.arange(8)
    errors_mm = {
        "vis+tac+pen": ours,
        "vis+pen": ours + np.where(np.isin(range(8), (3, 4)), 5.0, -0.001),
        "vis": ours + np.where(np.isin(range(8), (0, 1)), -0.5, 0.01),
    }
    best, of_vis, of_pen = sentences_of(tmp_path, errors_mm)
    assert best.startswith("After the turn, vis+tac+pen has the smallest median ADD-S")
    assert of_vis.startswith(
        "vis+tac+pen is smaller than vis in 6 of 8 sequences and larger in 2, which could be chance"
    )
    assert of_pen.startswith(
        "Pair by pair vis+pen is smaller than vis+tac+pen in 6 of 8 sequences, which could be"
    )


def test_where_the_pairs_speak_against_the_smallest_median_that_is_said(tmp_path):
    ours = np.repeat([1.0, 10.0], 10)
    errors_mm = {
        "vis+tac+pen": ours,
        "vis+pen": ours + np.where(np.arange(20) == 0, 19.0, -0.5),
        "vis": ours + 3.0,
    }
    best, _, of_pen = sentences_of(tmp_path, errors_mm)
    assert best.startswith("After the turn, vis+tac+pen has the smallest median ADD-S")
    assert of_pen.startswith(
        "Pair by pair, though, vis+pen is better than vis+tac+pen: smaller in 19 of 20 sequences (p"
    )


def test_settings_are_told_as_what_differs_and_in_full_where_they_are_folded(tmp_path):
    out = write_results(tmp_path, objects=["can"], runs=1)
    config = yaml.safe_load((out / "config.yaml").read_text())
    config["methods"]["vis+pen"] |= {"iterations": 3, "w_vis": [10.0, 2000.0]}
    config["methods"]["vis"] |= {"log_theta_vis": 800.0}  # refused by now
    (out / "config.yaml").write_text(yaml.safe_dump(config))
    html = make_report(out, make_tables(out)).read_text()
    said, full = html.split("All settings, as in")
    settings = re.sub(r"<[^>]*>", "", said.split('<ul class="settings">')[1])
    assert "vis: of another version of vtgtsam" in settings
    assert "vis+pen: other than recommended: iterations = 3, w_vis = (10, 2000)" in settings
    assert "vis+tac+pen: as recommended" in settings
    assert "held_pads" in full and "held_pads" not in settings


def test_position_rotation_and_coverage_stand_beside_adds(html, reported):
    tile = html.split('<div class="method">vis+tac+pen</div>')[1].split("</dl>")[0]
    said = dict(re.findall(r"<dt>(.*?)</dt><dd>(.*?)</dd>", tile.replace("\xa0", " ")))
    summary = pd.read_csv(reported / "summary.csv").query(
        "object == 'all' and phase == 'after' and noise_scale == 1 and method == 'vis+tac+pen'"
    )
    row = summary.iloc[0]
    assert said == {
        "position": f"{number(row['translation_median_mm'])} mm",
        "rotation": f"{number(row['rotation_median_deg'])}°",
        "below 5 mm": f"{100 * row['share_below_5mm']:.0f} %",
        "in 95 % region": f"{100 * row['share_in_95']:.0f} %",
    }
    assert (reported / "figures" / "vary_depth_pose_errors.png").exists()


def test_the_worst_sequences_are_folded(html):
    (folded,) = re.findall(r"<details>\s*<summary><h3>The worst.*?</details>", html, re.DOTALL)
    assert folded.count("<img") == 6


def test_the_best_method_is_praised_whichever_way_round_the_test_was(tmp_path):
    out = write_results(tmp_path, objects=list("abcdefghij"), runs=1)
    metrics = pd.read_parquet(out / "metrics.parquet")
    new_names = dict(zip(METHODS, METHODS[::-1], strict=True))  # the best one is now the first
    metrics["method"] = metrics["method"].map(new_names)
    order = metrics["method"].map(METHODS.index)
    metrics = metrics.iloc[np.argsort(order, kind="stable")]
    rewrite_metrics(out, metrics)
    sentences, group = verdicts(out)
    assert sentences[0].startswith("After the turn, vis has the smallest median ADD-S")
    (row,) = (
        group.tables.tests.query("comparison == 'vis+tac+pen vs vis' and phase == 'after'")
    ).to_dict("records")
    assert row["effect_size"] < 0
    ends = sorted(-row[f"difference_{end}_mm"] for end in ("low", "high"))
    assert sentences[2].startswith(
        f"vis is better than vis+tac+pen: smaller in {10 - row['n_better']} of 10 sequences, "
        f"by {number(-row['difference_mm'])} mm in the median "
        f"[{number(ends[0])}, {number(ends[1])}]"
    )


@pytest.mark.parametrize(
    ("p", "text"), [(1.0, "1"), (0.0312, "0.031"), (0.000152, "1.5 × 10⁻⁴"), (9e-14, "9.0 × 10⁻¹⁴")]
)
def test_a_small_p_is_told_as_it_was_found(p, text):
    assert p_value(p).replace("\xa0", " ") == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0.00"), (1.236, "1.24"), (-0.5, "−0.50"), (12.34, "12.3"), (123.4, "123")]
    + [(float("inf"), "∞"), (float("nan"), "–"), (0.0034, "0.003")],
)
def test_numbers_have_about_three_digits(value, text):
    assert number(value) == text


def test_what_is_missing_is_said_in_one_sentence(monkeypatch):
    assert report.missing_packages() == ""
    monkeypatch.setattr(extras, "_is_there", lambda name: False)
    assert report.missing_packages() == (
        f"figures and report.html need matplotlib and jinja2: {extras.install_line('evaluate')}, "
        "then `vtgtsam report` makes them from what is stored"
    )
