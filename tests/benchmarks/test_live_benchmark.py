# SPDX-License-Identifier: MIT
from __future__ import annotations

from held_box import write_grasp

from benchmarks.live import played
from vtgtsam import read_recording
from vtgtsam.live.fusion import LATENCY


def test_a_recording_is_played_into_the_live_loop_with_its_vision_late(tmp_path):
    recording = read_recording(write_grasp(tmp_path / "grasp.mcap"))
    fusion = played(recording, late=0.08, rate=30.0)
    assert fusion.count > 5
    assert fusion.latencies.percentiles(LATENCY)[0] > 0.0
    assert fusion.latencies.percentiles("image")[0] > 0.05
