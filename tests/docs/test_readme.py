# SPDX-License-Identifier: MIT
"""The README's program runs as it is printed."""

import re
from pathlib import Path

README = Path(__file__).parents[2] / "README.md"


def test_the_program_of_the_readme_prints_an_estimate(capsys):
    (program,) = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    assert len(program.splitlines()) <= 22
    found: dict[str, object] = {}
    exec(compile(program, str(README), "exec"), found)
    status, position, *_ = capsys.readouterr().out.splitlines()
    assert status == "ok"
    words = re.search(rf"# (.*{status}.*)", program.split("print(estimate.status)")[1])
    assert words is not None and "waiting" in words.group(1)
    assert len(position.strip("[]").split()) == 3
