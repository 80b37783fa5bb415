# SPDX-License-Identifier: MIT
"""What docs/recordings.md shows is what works."""

import re
from pathlib import Path

from vtgtsam.recording import load_topics, messages, names

PAGE = (Path(__file__).parents[3] / "docs" / "recordings.md").read_text()


def snippets(language):
    return re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)


def test_the_pages_code_runs_and_prints_what_it_says(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for code in snippets("python"):
        exec(code, {})
    assert capsys.readouterr().out == "100 can []\n"


def test_the_pages_map_is_valid(tmp_path):
    (map_text,) = snippets("yaml")
    (tmp_path / "map.yaml").write_text(map_text)
    topic_map = load_topics(tmp_path / "map.yaml")
    assert topic_map.topics.contacts.names == ("skin_a", "skin_b")
    assert topic_map.object.scale == 0.001


def test_the_page_names_every_topic_and_shows_our_message_as_it_is():
    for topic in (value for key, value in vars(names).items() if key.isupper() and value[0] == "/"):
        assert f"`{topic}`" in PAGE
    (shown,) = snippets("text")
    own = messages.definition(messages.TACTILE_PADS).split("=" * 80)[0]
    assert shown.strip() in own
