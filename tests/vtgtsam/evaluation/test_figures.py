# SPDX-License-Identifier: MIT
import hashlib

import matplotlib
import numpy as np
import pandas as pd
import pytest
from made_results import METHODS, PADS, write_results
from matplotlib.figure import Figure
from PIL import Image

from vtgtsam.evaluation.contacts import contact_shares, read_contacts
from vtgtsam.evaluation.figures import make_figures
from vtgtsam.evaluation.figures.boxes import grouped_boxes
from vtgtsam.evaluation.figures.marks import stars
from vtgtsam.evaluation.figures.methods import methods_figure
from vtgtsam.evaluation.figures.noise import noise_figure
from vtgtsam.evaluation.figures.objects import objects_figure, panels_figure
from vtgtsam.evaluation.figures.over_time import time_figure
from vtgtsam.evaluation.figures.style import STYLE, error_axis, looks
from vtgtsam.evaluation.figures.worst import worst_figure, worst_sequences
from vtgtsam.evaluation.groups import groups
from vtgtsam.evaluation.tables import make_tables

KINDS = (
    "coverage",
    "methods",
    "pose_errors",
    "time",
    "objects",
    "noise_before",
    "noise_after",
    "objects_time",
    "contacts",
)


def pixels(path):
    with Image.open(path) as image:
        return image.size, np.asarray(image.convert("L"))


def test_each_chapter_has_every_figure_and_none_is_blank(reported):
    names = {path.stem for path in (reported / "figures").glob("*.png")}
    kinds = {*KINDS, *(f"worst_{place}" for place in range(1, 7))}
    assert names == {f"vary_depth_{kind}" for kind in kinds}
    for path in (reported / "figures").glob("*.png"):
        (width, height), grey = pixels(path)
        assert width >= 800, path
        assert height >= 500, path
        assert 0.02 < (grey < 250).mean() < 0.8, path


def test_nothing_reaches_over_the_edge_of_a_figure(reported):
    for path in (reported / "figures").glob("*.png"):
        _, grey = pixels(path)
        edge = np.concatenate([grey[0], grey[-1], grey[:, 0], grey[:, -1]])
        assert (edge > 250).all(), path


def test_the_same_results_give_the_same_bytes(tmp_path):
    out = write_results(tmp_path, objects=["can"], runs=2)
    tables = make_tables(out)

    def drawn():
        chapters = make_figures(out, tables)
        svg = [p.svg for c in chapters for p in (*c.overview, *c.worst)]
        files = sorted((out / "figures").iterdir())
        return [hashlib.sha256(path.read_bytes()).hexdigest() for path in files], svg

    assert drawn() == drawn()


@pytest.fixture(scope="module")
def group(reported):
    return next(groups(make_tables(reported)))


def test_every_axis_says_what_it_shows_and_in_which_unit(group, reported):
    with matplotlib.rc_context(STYLE):
        drawings = [
            methods_figure(group),
            time_figure(group),
            noise_figure(group, "after"),
            objects_figure(group),
            panels_figure(group),
            worst_figure(group, reported, worst_sequences(group)[0], 1),
        ]
    for drawing in drawings:
        figure = drawing.figure
        labels = [label for ax in figure.axes for label in (ax.get_xlabel(), ax.get_ylabel())]
        labels += [figure.get_supxlabel(), figure.get_supylabel()]
        said = [label for label in labels if label]
        assert any(label.startswith("ADD-S") for label in said), drawing.name
        assert all("[" in label or "noise scale" in label for label in said), drawing.name
        assert drawing.alt
        assert drawing.caption


def test_a_method_differs_from_the_others_in_more_than_its_colour():
    found = looks([*METHODS, "mine", "yours"])
    for feature in ("color", "line", "hatch", "marker"):
        assert len({str(getattr(look, feature)) for look in found.values()}) == 5
    assert looks(["vis+tac+pen"])["vis+tac+pen"] == found["vis+tac+pen"]


def test_errors_of_similar_size_start_at_zero_and_others_are_logarithmic():
    ax = Figure().subplots()
    error_axis(ax, "y", np.array([1.0, 2.0, 5.0]))
    assert (ax.get_yscale(), ax.get_ylim()[0]) == ("linear", 0.0)
    error_axis(ax, "x", np.array([1.0, 2.0, 50.0, np.inf]))
    assert ax.get_xscale() == "log"
    low, high = ax.get_xlim()
    assert low < 1.0
    assert 50.0 < high < 100.0


def test_a_box_is_the_median_and_the_quartiles():
    values = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 20.0])
    ax = Figure().subplots()
    grouped_boxes(ax, [pd.DataFrame({"vis": values})], ["all"], looks(["vis"]))
    (box,) = ax.patches
    y = box.get_path().vertices[:, 1]
    assert (y.min(), y.max()) == pytest.approx((2.25, 4.75))
    whisker = max(line.get_ydata()[-1] for line in ax.lines if len(line.get_ydata()) == 2)
    assert whisker == 5.0  # 20 is beyond 4.75 + 1.5 * 2.5


def test_samples_without_a_pose_are_counted_above_the_axis():
    values = np.array([1.0, 2.0, 3.0, 4.0, np.inf, np.inf])
    ax = Figure().subplots()
    grouped_boxes(ax, [pd.DataFrame({"vis": values})], ["all"], looks(["vis"]))
    assert [text.get_text() for text in ax.texts] == ["↑2"]


@pytest.mark.parametrize(
    ("p", "effect", "note", "text"),
    [
        (0.2, 0.5, "", "n.s."),
        (0.04, 0.5, "", "*"),
        (0.00005, 0.9, "", "****"),
        (0.004, -0.9, "", "(**)"),
        (float("nan"), 0.0, "all 8 pairs equal: nothing to test", "–"),
        (0.06, 1.0, "too few pairs for p < 0.05: 5 differ, 6 needed", "–"),
    ],
)
def test_stars_say_how_sure_and_which_way(p, effect, note, text):
    assert stars({"p_holm": p, "effect_size": effect, "note": note}) == text


def test_significant_steps_are_marked_where_the_table_says_so(group):
    with matplotlib.rc_context(STYLE):
        above, _ = time_figure(group).figure.axes
    marked = {tuple(line.get_xdata()) for line in above.lines if line.get_marker() == "s"}
    tests = group.rows(group.tables.tests_time)
    expected = set()
    for other in ("vis", "vis+pen"):
        found = tests[tests["comparison"] == f"vis+tac+pen vs {other}"]
        found = found[(found["p_holm"] < 0.05) & (found["effect_size"] > 0)]
        expected.add(tuple(found["time_start_s"] + 0.25))
    assert marked == expected
    assert any(len(steps) for steps in marked)


def test_the_worst_sequences_are_those_of_the_last_method(group):
    rows = group.rows(group.tables.collected.phases)
    rows = rows.query("phase == 'after' and method == 'vis+tac+pen'")
    worst = rows.set_index("sequence")["adds_median_m"].sort_values()
    assert worst_sequences(group) == worst.index[::-1][:6].tolist()


def test_contact_shares_are_means_over_sequences(tmp_path):
    out = write_results(tmp_path, objects=["can"], runs=3)
    names = [f"vary__noise_1__can_{run}" for run in range(3)]
    found = contact_shares(out, names)
    assert (found.pads, found.sequences, found.other_hands) == (PADS, 3, 0)
    bits = np.stack([read_contacts(out, name).bits for name in names])  # (3, 24, K)
    np.testing.assert_allclose(found.shares, bits.reshape(3, 6, 4, -1).mean(axis=(0, 2)))


def test_a_single_sequence_is_shown_frame_by_frame(tmp_path):
    out = write_results(tmp_path, objects=["can"], runs=1)
    make_figures(out, make_tables(out))
    names = {path.stem for path in (out / "figures").iterdir()}
    kinds = ("coverage", "methods", "pose_errors", "time", "worst_1")
    assert names == {f"vary_depth_{kind}" for kind in kinds}


def test_without_stored_estimates_there_are_no_contacts_but_all_else(tmp_path):
    out = write_results(tmp_path, objects=["can"], estimates=False)
    make_figures(out, make_tables(out))
    names = {path.stem for path in (out / "figures").iterdir()}
    kinds = ("coverage", "methods", "pose_errors", "time", "worst_1", "worst_2")
    assert names == {f"vary_depth_{kind}" for kind in kinds}
