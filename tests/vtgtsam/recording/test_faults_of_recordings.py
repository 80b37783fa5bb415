# SPDX-License-Identifier: MIT
"""What the estimator names is told by inspect, the report's time line and the live status line."""

from types import SimpleNamespace

import numpy as np
from held_box import write_grasp
from matplotlib.figure import Figure

from vtgtsam.evaluation.figures.faults import fault_rows
from vtgtsam.live.verdict import in_words
from vtgtsam.recording import named_faults, usable
from vtgtsam.recording.inspect import inspect_recording
from vtgtsam.recording.named_faults import fault_sentences


def estimate(time, *faults, status="ok"):
    return SimpleNamespace(time=time, faults=faults, status=status)


def test_each_fault_is_a_sentence_with_its_frames_and_its_first_instant():
    jumps = [estimate(1.0 + n, "vision jumps") for n in range(3)]
    others = [estimate(10.0, "vision repeats itself"), estimate(11.0)]
    assert fault_sentences([*jumps, *others]) == ["vision jumps: in 3 of 5 frames, first at 1.00 s"]


def test_inspect_warns_of_what_the_estimator_names(tmp_path, monkeypatch):
    path = write_grasp(tmp_path / "a.mcap")
    assert not any("vision" in warning for warning in inspect_recording(path).warnings)
    sentence = "vision jumps: in 9 of 20 frames, first at 1.30 s"
    monkeypatch.setattr(usable, "named_faults", lambda recording: [sentence])
    found = inspect_recording(path)
    assert sentence in found.warnings and not found.problems


def test_a_recording_is_looked_at_frame_by_frame(tmp_path):
    from vtgtsam import read_recording

    recording = read_recording(write_grasp(tmp_path / "a.mcap"))
    assert named_faults.named_faults(recording) == []


def test_the_status_line_says_the_faults():
    assert in_words(estimate(0.0)) == "ok"
    assert in_words(estimate(0.0, "vision jumps", "pad a flickers", status="lost")) == (
        "lost: vision jumps, pad a flickers"
    )


def test_a_row_each_on_the_time_line():
    ax = Figure().subplots()
    fault_rows(ax, {"vision jumps": np.array([1.0, 2.0]), "pad a flickers": np.array([3.0])})
    assert [label.get_text() for label in ax.get_yticklabels()] == [
        "vision jumps",
        "pad a flickers",
    ]
    assert [line.get_xdata().tolist() for line in ax.lines] == [[1.0, 2.0], [3.0]]
