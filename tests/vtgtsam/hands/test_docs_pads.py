# SPDX-License-Identifier: MIT
"""What docs/pads.md shows is what works."""

import re
from pathlib import Path

import numpy as np
import pytest

from vtgtsam import HandModel, load_hand

PAGE = (Path(__file__).parents[3] / "docs" / "pads.md").read_text()


def snippets(language):
    return re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with the page's two hands, and one under the name of the page's other example."""
    mjcf, urdf = snippets("xml")
    (tmp_path / "pinch.xml").write_text(mjcf)
    (tmp_path / "pinch.urdf").write_text(urdf)
    (tmp_path / "pinch_plain.xml").write_text(re.sub("<site.*?/>", "", mjcf))
    (tmp_path / "pinch_pads.yaml").write_text(snippets("yaml")[0])
    (tmp_path / "allegro.urdf").write_text(urdf.replace('"pad_', '"skin_'))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_pages_code_runs_and_prints_what_it_says(folder, capsys):
    for code in snippets("python"):
        exec(code, {})
        said = re.findall(r"^print\(.*?\)\s+# ([(\[].*)$", code, flags=re.MULTILINE)
        printed = capsys.readouterr().out
        for line in said:
            assert line in printed


def test_both_files_describe_the_same_pads(folder):
    mjcf, urdf = load_hand("pinch.xml"), load_hand("pinch.urdf")
    assert mjcf.pad_names == urdf.pad_names == ("pad_palm", "pad_finger")
    for angle in (0.0, 0.7):
        np.testing.assert_allclose(
            mjcf.pad_transforms([angle]), urdf.pad_transforms([angle]), atol=1e-9
        )
    np.testing.assert_allclose(mjcf.pad_transforms([0.7])[1, :3, 2], (-np.sin(0.7), 0, np.cos(0.7)))


def test_the_pads_of_the_pages_yaml_lie_where_its_own_mjcf_has_them(folder):
    own, beside = load_hand("pinch.xml"), load_hand("pinch_pads.yaml")
    T_own, T_beside = own.pad_transforms([0.7]), beside.pad_transforms([0.7])
    np.testing.assert_allclose(T_beside[0], T_own[0], atol=1e-12)
    np.testing.assert_allclose(T_beside[1, :3, :3], T_own[1, :3, :3], atol=1e-12)
    lower = T_own[1, :3, 3] - 0.002 * T_own[1, :3, 2]  # the link's own box, 2 mm below the pad's
    np.testing.assert_allclose(T_beside[1, :3, 3], lower, atol=1e-12)
    np.testing.assert_allclose(
        [p.size for p in beside.pads], [p.size for p in own.pads], atol=1e-12
    )


def test_the_messages_of_the_page_are_the_programs_own(folder):
    mjcf = Path("pinch.xml").read_text()
    for change, heading in (
        (("pad_", "skin_"), "no box site or box geom is named 'pad_*'; boxes in the file: "),
        (('type="box" pos="0 0 0.0105"', 'pos="0 0 0.0105"'), "pad sites must be boxes (type="),
        (("0.030 0.020 0.0015", "0.0015 0.010 0.0015"), "of 3 x 20 mm has no room inside its 2 mm"),
        (('name="base">', 'name="base"><freejoint/>'), "has a free joint; remove it from the hand"),
    ):
        Path("broken.xml").write_text(mjcf.replace(*change))
        with pytest.raises(Exception, match=re.escape(heading)):
            HandModel.from_mjcf("broken.xml")
        assert heading in PAGE
