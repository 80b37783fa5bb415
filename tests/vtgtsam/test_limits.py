# SPDX-License-Identifier: MIT
from pathlib import Path

import pytest

from vtgtsam import VtgtsamError, limits
from vtgtsam.exceptions import MeshError

DOCS = Path(__file__).parents[2] / "docs" / "reference" / "limits.md"


def test_what_is_beyond_a_limit_is_refused_with_the_setting_that_raises_it():
    limits.check(10, 10, "faces in can.obj")
    with pytest.raises(
        MeshError, match=r"11 faces in can.obj are more than 10; .*VTGTSAM_LIMITS=10"
    ):
        limits.check(11, 10, "faces in can.obj", MeshError)


def test_nan_is_beyond_every_limit():
    with pytest.raises(VtgtsamError):
        limits.check(float("nan"), 10, "faces")


def test_one_setting_raises_all_limits(monkeypatch):
    monkeypatch.setenv("VTGTSAM_LIMITS", "2.5")
    limits.check(25, 10, "faces")
    with pytest.raises(VtgtsamError, match="26 faces are more than 25"):
        limits.check(26, 10, "faces")


@pytest.mark.parametrize("text", ["many", "0", "-1", "nan", ""])
def test_a_setting_that_is_no_number_above_0_is_refused(monkeypatch, text):
    monkeypatch.setenv("VTGTSAM_LIMITS", text)
    with pytest.raises(VtgtsamError, match="VTGTSAM_LIMITS must be a number above 0"):
        limits.check(1, 10, "faces")


def test_every_limit_is_in_the_documentation():
    text = DOCS.read_text(encoding="utf-8")
    names = [name for name in vars(limits) if name.isupper() and name != "SETTING"]
    assert len(names) > 15
    assert [name for name in names if f"`{name}`" not in text] == []
