# SPDX-License-Identifier: MIT
from __future__ import annotations

import errno
import threading

import pytest

from hardware.live.ages import check_ages, may_move, stale
from vtgtsam.exceptions import LiveError
from vtgtsam.live.recorder import Recorder
from vtgtsam.live.threads import Workers

FRESH = {"joints": 0.01, "pads": 0.02, "vision": 0.05}


@pytest.mark.parametrize(
    ("ages", "late", "moves"),
    [
        ({}, (), True),
        ({"joints": 0.11}, ("joints",), False),
        ({"pads": 0.11}, ("pads",), False),
        ({"vision": 0.19}, (), True),
        ({"vision": 0.21}, ("vision",), True),
    ],
)
def test_fingers_wait_for_joints_and_pads_but_not_for_vision(ages, late, moves):
    ages = {**FRESH, **ages}
    assert stale(ages) == late
    assert may_move(ages) is moves


def test_a_stream_silent_for_a_second_ends_the_run_with_advice():
    check_ages({"joints": 0.9, "pads": 0.9, "vision": 60.0})
    with pytest.raises(LiveError, match=r"no pads for 1\.2 s: is the pad board's cable loose"):
        check_ages({"joints": 0.1, "pads": 1.2})


def test_one_failing_thread_stops_all_and_the_main_thread_hears_why():
    others = []

    def fail(stop):
        raise RuntimeError("unplugged")

    def go_on(stop):
        others.append(stop.wait(30))

    with Workers() as workers:
        workers.start("good", go_on)
        workers.start("bad", fail)
        assert workers.stop.wait(10)
        with pytest.raises(RuntimeError, match="unplugged"):
            workers.check()
    assert others == [True]
    assert threading.active_count() < 20


class FullDisk:
    path = "out.mcap"

    def joint_states(self, time, value, **known):
        raise OSError(errno.ENOSPC, "No space left on device")

    def close(self):
        pass


def test_a_full_disk_is_not_silent():
    with (
        pytest.raises(LiveError, match=r"cannot go on writing out\.mcap: No space left.*make room"),
        Recorder(FullDisk()) as recorder,
    ):
        recorder.write("joint_states", 0, 1.0)


def test_images_that_could_not_be_recorded_in_time_are_told():
    gate = threading.Event()

    class Slow:
        path = "out.mcap"

        def depth(self, time, image):
            gate.wait(30)

        def close(self):
            pass

    with Recorder(Slow()) as recorder:
        assert recorder.remarks() == []
        for k in range(100):
            recorder.write_image("depth", k, None)
        gate.set()
    assert recorder.images_dropped > 30
    assert "images are missing in the recording" in recorder.remarks()[0]
