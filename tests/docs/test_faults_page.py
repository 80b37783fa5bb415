# SPDX-License-Identifier: MIT
"""docs/how-to/faults.md has a row for each status and each fault."""

from pathlib import Path
from typing import get_args

import pytest

from vtgtsam.estimate import Status
from vtgtsam.faults import words

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "faults.md").read_text(encoding="utf-8")
FAULTS = [value for name, value in vars(words).items() if name.isupper()]
OF_A_PAD = [words.pad_disagrees("NAME"), words.pad_flickers("NAME")]


@pytest.mark.parametrize("word", [*FAULTS, *OF_A_PAD, *get_args(Status)])
def test_each_word_has_a_row(word):
    assert any(line.startswith("|") and f"`{word}`" in line for line in PAGE.splitlines())
