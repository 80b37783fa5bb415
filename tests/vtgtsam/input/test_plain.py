# SPDX-License-Identifier: MIT
from vtgtsam.input.plain import plain, sentence


def test_ordinary_text_stays():
    assert plain("Kaffeetasse, 80 × 90 mm") == "Kaffeetasse, 80 × 90 mm"


def test_what_moves_the_cursor_or_starts_a_line_is_written_out():
    assert plain("a\n  no problems found\x1b[2J\r\u202e") == (
        r"a\n  no problems found\x1b[2J\r\u202e"
    )


def test_long_text_is_cut():
    assert plain("x" * 5000, 10) == "x" * 10 + "..."


def test_a_sentence_is_one_line():
    assert sentence("it is\n  broken:\t\x1b[1m") == r"it is broken: \x1b[1m"
