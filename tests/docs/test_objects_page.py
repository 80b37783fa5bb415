# SPDX-License-Identifier: MIT
"""What docs/objects.md shows is what works."""

import re
from pathlib import Path

import trimesh

PAGE = (Path(__file__).parents[2] / "docs" / "objects.md").read_text()


def test_the_pages_code_runs_and_prints_what_it_says(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("VTGTSAM_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    trimesh.creation.cylinder(radius=0.03, height=0.1).export("my_can.obj")
    trimesh.creation.box(extents=(0.03, 0.05, 0.1)).export("my_box.obj")
    (code,) = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    exec(code, {})
    said = re.findall(r"^print\(.*\)\s+# (.*)$", code, flags=re.MULTILINE)
    assert capsys.readouterr().out.splitlines() == said and len(said) == 2
