# SPDX-License-Identifier: MIT
"""No command of the bench writes over a file that nobody said to replace, and none starts the work first."""

import pytest
from typer.testing import CliRunner

from hardware.__main__ import app

COMMANDS = {
    "calibrate-pads": "calibrate-pads --emulate --scale FILE",
    "calibrate-wrist": "calibrate-wrist --emulate --wrist FILE",
    "calibrate-joints": "calibrate-joints --out FILE --servos /dev/null",
    "run, its recording": "run --emulate --object can --record FILE",
    "run, what it has calibrated": "run --emulate --object can --calibration-out FILE",
    "run, its view": "run --emulate --object can --save-view FILE",
}


@pytest.mark.parametrize("name", COMMANDS)
def test_a_file_that_is_there_is_kept_unless_forced(tmp_path, name):
    file = tmp_path / "file.rrd"
    file.write_text("a person's own")
    answer = CliRunner().invoke(app, COMMANDS[name].replace("FILE", str(file)).split())
    assert f"{file} is there already" in str(answer.exception)
    assert file.read_text() == "a person's own"
