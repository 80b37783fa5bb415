# SPDX-License-Identifier: MIT
"""The sketch of the pad board and its C encoder, compiled for this machine."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from hardware.tactile.frame import Frame, FrameReader, encode

HERE = Path(__file__).parent
SKETCH = HERE.parents[2] / "hardware" / "firmware" / "pad_board"
WARNINGS = ("-Wall", "-Wextra", "-Werror", "-pedantic")


def compiled(tmp_path, compiler, source, *flags):
    if shutil.which(compiler) is None:
        pytest.skip(f"no C compiler: '{compiler}' is not installed")
    program = tmp_path / "program"
    command = [compiler, *flags, *WARNINGS, "-I", str(SKETCH), str(source), "-o", str(program)]
    result = subprocess.run(command, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    return program


def test_the_c_encoder_writes_the_same_bytes_as_the_python_one(tmp_path):
    program = compiled(tmp_path, "cc", HERE / "pad_frame_host.c", "-std=c99")
    rng = np.random.default_rng(0)
    frames = [
        Frame(
            int(rng.integers(2**16)),
            int(rng.integers(2**32)),
            tuple((rng.integers(2**16, size=n) * (rng.random(n) < 0.7)).tolist()),
        )
        for n in rng.integers(33, size=2000)
    ]
    lines = [
        f"{f.sequence} {f.board_time_us} {len(f.readings)} {' '.join(map(str, f.readings))}"
        for f in frames
    ]
    run = subprocess.run(
        [program], input="\n".join(lines).encode(), capture_output=True, timeout=20
    )
    assert run.stdout == b"".join(encode(frame) for frame in frames)


def test_the_c_encoder_writes_nothing_rather_than_past_its_buffer(tmp_path):
    program = compiled(tmp_path, "cc", HERE / "pad_frame_host.c", "-std=c99")
    line = f"1 2 33 {' 7' * 33}\n".encode()
    assert subprocess.run([program], input=line, capture_output=True, timeout=20).stdout == b""


@pytest.mark.parametrize("board", ["PAD_BOARD_10_BIT", "PAD_BOARD_12_BIT", "MULTIPLEXER"])
def test_the_sketch_sends_its_inputs_fifty_times_a_second(tmp_path, board):
    flags = ("-std=c++17", f"-D{board}=1")
    program = compiled(tmp_path, "c++", HERE / "pad_board_host.cpp", *flags)
    sent = subprocess.run([program], capture_output=True, timeout=20).stdout
    reader = FrameReader()
    frames = reader.feed(sent)
    assert reader.bad == 0 and len(frames) == 100
    assert [frame.sequence for frame in frames] == list(range(100))
    periods = np.diff([frame.board_time_us for frame in frames]) % 2**32
    assert np.abs(periods - 20_000).max() < 500
    share = np.array(frames[0].readings) / 65535
    np.testing.assert_allclose(share, np.arange(14) / 100, atol=1 / 1023)  # the converter's step
