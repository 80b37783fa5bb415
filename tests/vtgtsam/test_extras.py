# SPDX-License-Identifier: MIT
"""What works without an extra, and what is said where it does not."""

import subprocess
import sys

import pytest

from vtgtsam.extras import PACKAGES, install_line

WITHOUT = "import sys; sys.modules.update(dict.fromkeys({modules}, None)); "  # as if not installed
EVERYTHING = sorted({module for modules in PACKAGES.values() for module in modules})


def said(code: str, modules) -> str:
    answer = subprocess.run(
        [sys.executable, "-c", WITHOUT.format(modules=list(modules)) + code],
        capture_output=True,
        text=True,
    )
    return (answer.stdout or answer.stderr).strip().splitlines()[-1]


def test_the_core_estimates_a_pose_without_any_extra():
    code = """
import gtsam, numpy as np
from vtgtsam import Measurement, Pad, PadSet, PoseEstimator, load_object
estimator = PoseEstimator(PadSet([Pad("pad", (0.02, 0.02))]), load_object("can"))
T_wp = np.eye(4)[None]
print(estimator.update(Measurement(0.0, [True], T_wp=T_wp, T_wo_visual=gtsam.Pose3())).status)
"""
    assert said(code, EVERYTHING) == "ok"


@pytest.mark.parametrize(
    ("code", "extra"),
    [
        ("from vtgtsam import load_hand", "mjcf"),
        ("from vtgtsam import read_recording", "recordings"),
        ("from vtgtsam.recording import RecordingWriter", "recordings"),
        ("from vtgtsam import calibrate", "recordings"),
        ("from vtgtsam import evaluate", "evaluate"),
        ("import vtgtsam.viz", "viz"),
        ("from vtgtsam.__main__ import main; main()", "cli"),
    ],
)
def test_what_needs_an_extra_says_which_with_a_line_that_installs_it(code, extra):
    last = said(code, EVERYTHING)
    assert last.endswith(f": {install_line(extra)}")
    assert "need" in last


def test_the_line_is_one_for_the_checkout_and_one_for_an_installed_package(tmp_path, monkeypatch):
    assert install_line("viz").startswith("pip install -e '/")
    monkeypatch.setattr("vtgtsam.extras.__file__", str(tmp_path / "vtgtsam" / "extras.py"))
    assert install_line("viz") == "pip install 'vtgtsam[viz]'"


def test_a_command_says_in_one_sentence_what_it_lacks():
    code = "import sys; sys.argv = ['vtgtsam', 'evaluate', 'x', '--out', 'y']; "
    code += "from vtgtsam.__main__ import main; main()"
    assert said(code, PACKAGES["evaluate"]) == (
        f"vtgtsam: an evaluation needs pandas, pyarrow, joblib and threadpoolctl: {install_line('evaluate')}"
    )
