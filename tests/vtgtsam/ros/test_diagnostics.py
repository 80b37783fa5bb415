# SPDX-License-Identifier: MIT
"""What the diagnostics say; the node's own tests see them sent."""

from __future__ import annotations

from types import SimpleNamespace as Message

import gtsam
import numpy as np
import pytest

from vtgtsam.live.fusion import Fusion
from vtgtsam.live.inputs import Inputs
from vtgtsam.live.recorder import Recorder
from vtgtsam.ros.health import (
    EstimateHealth,
    Level,
    Link,
    TopicHealth,
    in_words,
    judge_recorder,
)
from vtgtsam.ros.intake import Intake, joints_intake
from vtgtsam.ros.publisher_clock import PublisherClock

S = 10**9
NAMES = ("j_a", "j_b")


class Bench:
    def __init__(self, needed=Level.ERROR):
        self.now = 100 * S
        self.clock = PublisherClock(lambda: self.now)
        self.inputs = Inputs(
            NAMES, ("pad",), self.clock.now_ns, Recorder(None), steady=lambda: self.now
        )
        self.link = Link(joints_intake("/robot/joints", self.inputs, self.clock), needed)
        self.link.publishers = ("/driver",)
        self.health = TopicHealth("joints", self.link, self.inputs)

    def send(self, names=NAMES, stamp_ns=None, angles=None):
        stamp_ns = self.now if stamp_ns is None else stamp_ns
        stamp = Message(sec=stamp_ns // S, nanosec=stamp_ns % S)
        angles = [0.0] * len(names) if angles is None else angles
        self.link.intake(Message(header=Message(stamp=stamp), name=list(names), position=angles))

    def judge(self, after=0.0):
        self.now += round(after * S)
        return self.health.judge(self.now / S)


@pytest.fixture
def bench():
    return Bench()


def test_a_topic_that_speaks_is_fine(bench):
    bench.send()
    condition = bench.judge()
    assert (condition.level, condition.message) == (Level.OK, "fine")
    assert condition.values["publishers"] == "/driver"


def test_a_topic_that_has_never_spoken_is_named_and_whether_someone_is_there(bench):
    assert bench.judge().message == "nothing has come on /robot/joints"
    bench.link.publishers = ()
    assert bench.judge().message == "nothing has come on /robot/joints, no publisher is there"


def test_a_topic_that_fell_silent_is_named_with_what_it_means(bench):
    bench.send()
    bench.link.publishers = ()
    condition = bench.judge(after=2.0)
    assert condition.level is Level.ERROR
    assert condition.message.startswith(
        "/robot/joints is silent for 2.0 s, no publisher is there: nothing is fused"
    )


def test_names_that_never_came_or_stay_behind_are_listed(bench):
    bench.send(("j_a",))
    assert "never came: j_b" in bench.judge().message
    bench.send(("j_b",))
    for _ in range(10):
        bench.now += S // 10
        bench.send(("j_a",))
    assert "behind the others by more than 0.5 s: j_b" in bench.judge().message


def test_garbage_odd_stamps_and_second_publishers_are_told(bench):
    bench.send()
    bench.send(angles=[1.0])
    assert "1 of 2 messages could not be used, the last one has 1 angles" in bench.judge().message
    bench.send(stamp_ns=bench.now + 3600 * S)
    assert "1 stamps were off, the last by +3600.0 s" in bench.judge().message
    for _ in range(20):
        bench.now += S // 100
        bench.send()
        bench.send()  # the other one
    assert "do two publishers send the same names?" in bench.judge().message


def test_a_problem_with_the_type_is_what_is_said(bench):
    bench.link.problem = "/robot/joints has type std_msgs/msg/String"
    assert bench.judge().message == bench.link.problem


def test_what_stands_still_need_not_say_so_again(bench):
    intake = Intake("/wrist", (), lambda message: None)
    health = TopicHealth(
        "hand_pose", Link(intake, Level.WARN), bench.inputs, lambda: bench.inputs.hand_pose
    )
    intake(None)
    bench.inputs.put_hand_pose(bench.now, gtsam.Pose3())
    bench.now += 10 * S
    assert health.judge(0.0).level is Level.OK
    bench.inputs.put_hand_pose(bench.now, gtsam.Pose3(gtsam.Rot3(), np.ones(3)))
    bench.now += 10 * S
    assert "/wrist is silent for 10.0 s" in health.judge(0.0).message


def test_an_estimate_that_waits_and_a_recording_that_failed_are_told(bench, tmp_path):
    estimator = Message(config=Message(memory=True))
    fusion = Fusion(bench.inputs, estimator, bench.clock.now_ns)
    condition = EstimateHealth(fusion, bench.clock).judge(0.0)
    assert condition.level is Level.WARN and "waiting" in condition.message

    def refuse():
        raise OSError(28, "No space left on device", str(tmp_path / "run.mcap"))

    recorder = Recorder(None, refuse)
    with pytest.raises(Exception, match="No space left"), recorder:
        recorder.begin_another(always=True)
        while recorder.on:
            pass
        assert judge_recorder(recorder).level is Level.ERROR
    assert "waiting" in in_words([condition])
