# SPDX-License-Identifier: MIT
"""Commands on a disk that is full: a sentence with the file's name, and nothing half-written.

A limit on the size of files (RLIMIT_FSIZE) stands for the disk: writing beyond it fails as on a full one, in a copy of
this process.
"""

import sys
from pathlib import Path

import pytest
from held_box import HAND_XML, box_obj, write_grasp

if sys.platform != "linux":
    pytest.skip("forks", allow_module_level=True)

import resource

from fuzzing import child
from fuzzing.kinds.kind import run

TUM = "".join(f"{1 + 0.033 * k:.6f} 0.1 0.2 0.3 0 0 0 1\n" for k in range(20))


@pytest.fixture(scope="module")
def given(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("given")
    write_grasp(folder / "grasp.mcap")
    (folder / "box.obj").write_bytes(box_obj())
    (folder / "hand.xml").write_text(HAND_XML)
    (folder / "claw.xml").write_text(CLAW)
    (folder / "poses.txt").write_text(TUM)
    compiled = ("view", folder / "grasp.mcap", "--save", folder / "whole.rrd")
    assert run(*compiled)[0] == 0  # what is slow is loaded once, before the copies
    return folder


CLAW = """<mujoco model="claw"><worldbody><body name="palm"><geom type="box" size="0.04 0.01 0.05" mass="0.1"/>
<body name="finger" pos="0 0 0.06"><joint name="bend" axis="1 0 0" range="0 1.6"/>
<geom type="box" pos="0 0 0.02" size="0.012 0.008 0.02" mass="0.01"/></body></body></worldbody></mujoco>"""
COMMANDS = {  # with how many bytes fit on the disk
    "convert": (4000, "convert grasp.mcap --out OUT/new.mcap"),
    "a mesh unpacked": (200, "convert grasp.mcap --out OUT/new.mcap"),
    "attach-vision": (4000, "attach-vision grasp.mcap poses.txt --out OUT/new.mcap"),
    "evaluate": (200, "evaluate grasp.mcap --methods vis --out OUT"),
    "calibrate": (200, "calibrate grasp.mcap --out OUT/new.yaml"),
    "sdf": (200, "sdf box.obj --out OUT/new.npz --resolution 16"),
    "suggest-pads": (20, "suggest-pads claw.xml --out OUT/new.yaml"),
    "check-hand": (200, "check-hand hand.xml --out OUT/new.png"),
    "view": (4000, "view grasp.mcap --save OUT/new.rrd"),
}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_full_disk_is_told_with_the_files_name_and_nothing_half_written_stays(
    given, tmp_path, monkeypatch, name
):
    monkeypatch.chdir(given)
    out = tmp_path / "out"
    out.mkdir()
    fits, words = COMMANDS[name]
    arguments = words.replace("OUT", str(out)).split()

    def on_a_full_disk() -> str:
        resource.setrlimit(resource.RLIMIT_FSIZE, (fits, fits))
        code, text = run(*arguments)
        last = (text.strip().splitlines() or [""])[-1]
        if code != 1:
            return f"ends with {code}: {text}"
        named = last.startswith("vtgtsam: ") and last.count("/") > 1
        return "" if named else f"says: {text}"

    assert child.run(on_a_full_disk, tmp_path).problem == ""
    assert [p for p in out.rglob("*") if p.is_file() and ".vtgtsam" not in p.parts] == []
