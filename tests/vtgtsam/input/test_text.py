# SPDX-License-Identifier: MIT
import os

import pytest

from vtgtsam.exceptions import ConfigError
from vtgtsam.input.text import parse_json, parse_yaml, read_yaml

BOMB = "a: &a [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{b}: &{b} [{', '.join(['*' + a] * 10)}]\n" for a, b in zip("abcdefg", "bcdefgh", strict=True)
)


def test_plain_content_comes_back():
    content = parse_yaml("a: [1, 0x10, 2.5, yes, text]\nb: &x {c: null}\nd: *x", "it")
    assert content == {"a": [1, 16, 2.5, True, "text"], "b": {"c": None}, "d": {"c": None}}


@pytest.mark.parametrize(
    "text",
    [
        "[" * 10_000,
        "{a: " * 10_000,
        BOMB,
        "a: " + "9" * 10_000,
        "a: " + "9" * 400,
        "a: -0x" + "f" * 300,
        "a: !!python/object/apply:os.system [ls]",
        "a: *unknown",
        "? [a]\n: b",
        "a: &a [*a]\nb: !!set {[]}",
        "a: 2001-99-99",
        "a: !!binary '€'",
        "\x00",
        "a: [",
    ],
)
def test_whatever_is_wrong_with_it_is_one_sentence_that_names_it(text):
    with pytest.raises(ConfigError, match="the settings ") as error:
        parse_yaml(text, "the settings", ConfigError)
    assert len(str(error.value)) < 600


def test_bytes_that_are_no_text_are_one_sentence(tmp_path):
    (tmp_path / "a.yaml").write_bytes("grün: 1".encode("latin-1"))
    with pytest.raises(ConfigError, match=r"a\.yaml is not valid YAML"):
        read_yaml(tmp_path / "a.yaml", ConfigError)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="has no pipes")
def test_a_pipe_is_refused_instead_of_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    with pytest.raises(ConfigError, match=r"pipe\.yaml is no regular file"):
        read_yaml(tmp_path / "pipe.yaml", ConfigError)


@pytest.mark.parametrize(
    "text", ["[" * 100_000, "9" * 10_000, "-" + "9" * 400, "{", "NaN?", '"\ud800"}']
)
def test_json_that_is_none_is_one_sentence(text):
    with pytest.raises(ConfigError, match="^the symmetry "):
        parse_json(text, "the symmetry", ConfigError)
