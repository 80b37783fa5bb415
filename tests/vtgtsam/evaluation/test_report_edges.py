# SPDX-License-Identifier: MIT
"""Results that are not like the paper's: no turn, one method, one frame, no names."""

import re

import pytest
from held_box import write_grasp

from vtgtsam import evaluate
from vtgtsam.evaluation.report import make_report
from vtgtsam.evaluation.tables import make_tables

pytestmark = pytest.mark.filterwarnings("error::UserWarning", "error::RuntimeWarning")


def page(out, *recordings, methods=("vis", "vis+pen")):
    evaluate(recordings, methods, "tuned", out)
    return make_report(out, make_tables(out)).read_text().replace("\xa0", " ")


def test_recordings_that_name_nothing_and_hands_that_do_not_turn(tmp_path):
    names = {"dataset": "", "tracker": ""}
    paths = [write_grasp(tmp_path / f"{k}.mcap", k, 6, turn=False, **names) for k in range(2)]
    html = page(tmp_path / "out", *paths)
    assert "All recordings" in html
    assert "Over the whole sequence, vis" in html
    assert "the turn" not in re.sub(r"<figcaption>.*?</figcaption>", "", html)


def test_one_method_is_compared_with_nothing(tmp_path):
    html = page(tmp_path / "out", write_grasp(tmp_path / "0.mcap", frames=6), methods=["vis"])
    assert re.search(r"After the turn, the median ADD-S of vis is \d\.\d\d mm\.", html)
    assert "Paired tests" not in html


def test_one_frame(tmp_path):
    html = page(tmp_path / "out", write_grasp(tmp_path / "0.mcap", frames=1))
    assert "With 1 sequence nothing can be said about chance" in html


def test_names_that_are_no_file_names(tmp_path):
    out = tmp_path / "out"
    html = page(out, write_grasp(tmp_path / "0.mcap", frames=6, dataset="../<i>a b</i>"))
    assert "Dataset ../&lt;i&gt;a b&lt;/i&gt;" in html
    assert {path.name.split("_")[0] for path in (out / "figures").iterdir()} == {"i-a-b--i-"}
