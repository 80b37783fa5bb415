# SPDX-License-Identifier: MIT
"""What messages become, without ROS: they are plain objects with their definition's fields."""

from __future__ import annotations

from array import array
from types import SimpleNamespace as Message

import gtsam
import numpy as np
import pytest

from vtgtsam.live.inputs import Inputs
from vtgtsam.live.recorder import Recorder
from vtgtsam.live.slots import PoseSlot
from vtgtsam.recording import messages
from vtgtsam.recording.topics import ContactsTopic, Topics
from vtgtsam.ros.intake import contacts_intake, hand_pose_intake, joints_intake, vision_intake
from vtgtsam.ros.publisher_clock import PublisherClock
from vtgtsam.ros.transforms import TransformTree, tf_intakes

S = 10**9
JOINTS, PADS = ("j_a", "j_b", "j_c"), ("pad_a", "pad_b")
T = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.3, -0.2, 0.5), np.array([0.1, 0.2, 0.3]))


def header(stamp_ns, frame=""):
    stamp = Message(sec=stamp_ns // S, nanosec=stamp_ns % S)
    return Message(stamp=stamp, frame_id=frame)


def pose(T):
    fields = messages.pose_fields(T)
    return Message(**{part: Message(**values) for part, values in fields.items()})


def pose_stamped(stamp_ns, T):
    return Message(header=header(stamp_ns), pose=pose(T))


class Bench:
    def __init__(self):
        self.now = 100 * S
        self.clock = PublisherClock(lambda: self.now)
        self.inputs = Inputs(JOINTS, PADS, self.clock.now_ns, Recorder(None))
        self.camera = PoseSlot()

    def contacts(self, **entry):
        return contacts_intake(
            ContactsTopic(topic="/c", names=PADS, **entry), self.inputs, self.clock
        )

    def vision(self, **entry):
        topics = Topics(joints="/j", contacts="/c", vision={"topic": "/v", **entry})
        return vision_intake(topics, self.inputs, self.camera, self.clock)


@pytest.fixture
def bench():
    return Bench()


def test_joints_come_in_parts_and_in_any_order(bench):
    take = joints_intake("/j", bench.inputs, bench.clock)
    take(Message(header=header(99 * S), name=["j_c", "wheel"], position=array("d", [3.0, 9.0])))
    take(Message(header=header(99 * S + 1), name=["j_b", "j_a"], position=array("d", [2.0, 1.0])))
    assert bench.inputs.joints_at(100 * S).tolist() == [1.0, 2.0, 3.0]


def test_a_stamp_from_elsewhere_does_not_move_the_present_and_a_clock_that_jumped_does(bench):
    take = joints_intake("/j", bench.inputs, bench.clock)
    bench.inputs.on_forget = bench.clock.restart

    def tell(stamp_ns):
        bench.now += S // 100
        take(Message(header=header(stamp_ns), name=list(JOINTS), position=[0.0] * 3))
        return bench.clock.now_ns()

    for k in range(20):
        assert tell(9000 * S + k * S // 100) == 9000 * S + k * S // 100
    assert abs(tell(2**31 * S) - 9000 * S) < S
    for k in range(20):
        present = tell(50 * S + k * S // 100)
    assert abs(present - 50 * S) < S


@pytest.mark.parametrize(
    ("names", "positions", "why"),
    [
        ([], [], "0 angles for 0 names"),
        (["j_a", "j_b"], [1.0], "1 angles for 2 names"),
        (["j_a"], ["wide"], "could not convert|must be real|ufunc"),
    ],
)
def test_a_joint_message_that_makes_no_sense_costs_itself(bench, names, positions, why):
    take = joints_intake("/j", bench.inputs, bench.clock)
    take(Message(header=header(99 * S), name=names, position=positions))
    assert take.unusable == take.messages == 1
    pytest.importorskip("re").search(why, take.why) or pytest.fail(take.why)
    assert bench.inputs.count("joints") == 0


def test_a_stamp_of_zero_is_that_of_receipt_unless_others_have_stamps(bench):
    take = joints_intake("/j", bench.inputs, bench.clock)
    take(Message(header=header(0), name=list(JOINTS), position=[0.0] * 3))
    assert bench.inputs.joints.known_ns == 100 * S
    take(Message(header=header(101 * S), name=list(JOINTS), position=[0.0] * 3))
    take(Message(header=header(0), name=list(JOINTS), position=[0.0] * 3))
    assert take.unusable == 1 and "no stamp" in take.why


@pytest.mark.parametrize(
    ("entry", "data", "expected"),
    [
        ({}, array("B", [0, 1]), [False, True]),
        ({"threshold": 0.4}, array("f", [0.5, 0.3]), [True, False]),
        ({"threshold": 0.4}, array("d", [np.nan, 0.4]), None),  # never known
    ],
)
def test_arrays_become_contacts_by_the_maps_names_and_threshold(bench, entry, data, expected):
    bench.contacts(**entry)(Message(data=data))
    found = bench.inputs.contacts_at(bench.now)
    assert (None if found is None else found.tolist()) == expected


@pytest.mark.parametrize(
    ("entry", "message", "why"),
    [
        ({}, Message(data=array("f", [0.5, 0.3])), "needs a threshold"),
        ({"threshold": 0.4}, Message(data=array("f", [0.5])), "1 values for 2 names"),
        (
            {},
            Message(header=header(1), name=["pad_a"], effort=[1.0], position=[]),
            "needs a threshold",
        ),
    ],
)
def test_contacts_that_make_no_sense_say_what_is_missing(bench, entry, message, why):
    take = bench.contacts(**entry)
    take(message)
    assert take.unusable == 1 and why in take.why


def test_efforts_and_pads_with_bits_of_their_own_are_contacts_too(bench):
    bench.contacts(threshold=2.0)(
        Message(header=header(99 * S), name=list(PADS), effort=[1.0, 3.0], position=[])
    )
    assert bench.inputs.contacts_at(bench.now).tolist() == [False, True]
    own = Message(
        header=header(99 * S + 1), name=list(PADS), pressure=[0.9, 0.0], contact=[True, False]
    )
    bench.contacts()(own)
    assert bench.inputs.contacts_at(bench.now).tolist() == [True, False]


def test_raw_values_become_contacts_once_the_untouched_pads_are_known(bench):
    take = bench.contacts(threshold=0.15, calibration={"untouched": 1.0, "drop": 100.0})
    for k in range(0, 12):
        bench.now = 100 * S + k * S // 10
        take(Message(data=array("f", [1000.0, 2000.0])))
        known = bench.inputs.contacts_at(bench.now)
        assert (known is None) == (k <= 10)
    bench.now += S
    take(Message(data=array("f", [980.0, 1990.0])))
    assert bench.inputs.contacts_at(bench.now).tolist() == [True, False]


def test_pads_that_were_touched_at_first_are_named_and_learnt_again(bench):
    take = bench.contacts(threshold=0.15, calibration={"untouched": 1.0, "drop": 100.0})
    for k in range(0, 24):
        bench.now = 100 * S + k * S // 10
        take(Message(data=array("f", [1000.0 - 50 * (k % 2) * (k < 12), 2000.0])))
    assert take.unusable == 1 and "pad_a changed in the first 1 s" in take.why
    assert bench.inputs.contacts_at(bench.now) is not None


def test_a_trackers_pose_is_taken_to_its_images_instant_and_to_the_world(bench):
    bench.camera.put(0, T)
    take = bench.vision(latency=0.05, frame="camera")
    T_co = gtsam.Pose3(gtsam.Rot3.Rx(0.1), np.array([0.0, 0.0, 0.5]))
    take(pose_stamped(100 * S, T_co))
    (seen,) = bench.inputs.vision.waiting(100 * S)
    assert seen.stamp_ns == 100 * S - 50_000_000
    assert seen.T_wo.equals(T * T_co, 1e-12)
    assert seen.covariance is None


def test_without_the_cameras_pose_a_camera_pose_cannot_be_used(bench):
    take = bench.vision(frame="camera")
    take(pose_stamped(100 * S, T))
    assert "camera's frame, whose pose is not known" in take.why


def test_a_trackers_covariance_is_turned_into_the_objects_frame(bench):
    turned = gtsam.Pose3(gtsam.Rot3.Rz(np.pi / 2), np.zeros(3))
    ros = np.diag([1e-6, 4e-6, 9e-6, 1e-4, 2e-4, 3e-4])
    message = Message(
        header=header(99 * S), pose=Message(pose=pose(turned), covariance=ros.ravel().tolist())
    )
    bench.vision()(message)
    (seen,) = bench.inputs.vision.waiting(100 * S)
    expected = [
        2e-4,
        1e-4,
        3e-4,
        4e-6,
        1e-6,
        9e-6,
    ]  # rotation first; x of the object is y of the world
    np.testing.assert_allclose(np.diag(seen.covariance), expected, atol=1e-12)


def test_a_pose_that_is_none_or_the_identity_between_others_is_left_out(bench):
    take = bench.vision()
    take(pose_stamped(99 * S, T))
    take(pose_stamped(99 * S + 1, gtsam.Pose3()))
    assert "is the identity" in take.why
    broken = pose_stamped(99 * S + 2, T)
    broken.pose.orientation.w = np.nan
    take(broken)
    assert take.unusable == 2 and "not finite" in take.why


def test_a_pose_that_two_subscriptions_bring_counts_once(bench):
    take = hand_pose_intake("/h", bench.inputs, bench.clock)
    for _ in range(2):
        take(pose_stamped(99 * S, T))
    assert bench.inputs.count("hand_pose") == 1 and bench.inputs.refused("hand_pose") == 0


def transform(stamp_ns, parent, child, T):
    fields = messages.pose_fields(T)
    return Message(
        header=header(stamp_ns, parent),
        child_frame_id=child,
        transform=Message(
            translation=Message(**fields["position"]), rotation=Message(**fields["orientation"])
        ),
    )


def test_a_chain_of_transforms_is_a_pose():
    tree = TransformTree()
    A, B, C = (T.retract(np.full(6, 0.1 * k)) for k in range(3))
    tree.update(
        Message(transforms=[transform(5, "/base", "arm", B), transform(9, "arm", "wrist", C)])
    )
    assert tree.pose("world", "wrist") is None
    tree.update(Message(transforms=[transform(1, "world", "base", A)]))
    stamp_ns, found, between = tree.pose("world", "wrist")
    assert stamp_ns == 9 and between == {"base", "arm", "wrist"}
    assert found.equals(A * B * C, 1e-12)


def test_transforms_in_a_loop_are_no_pose():
    tree = TransformTree()
    tree.update(Message(transforms=[transform(1, "a", "b", T), transform(1, "b", "a", T)]))
    assert tree.pose("world", "a") is None


def test_a_pose_comes_from_tf_when_one_of_its_links_moves():
    got = []
    intakes = tf_intakes({"hand_pose": (("world", "wrist"), lambda *pose: got.append(pose))})
    intakes["/tf_static"](Message(transforms=[transform(1, "arm", "wrist", T)]))
    intakes["/tf"](Message(transforms=[transform(7, "world", "arm", T)]))
    intakes["/tf"](Message(transforms=[transform(8, "world", "table", T)]))
    assert [stamp for stamp, _ in got] == [7]
    assert got[0][1].equals(T * T, 1e-12)


class TestPublisherClock:
    def test_stamps_of_this_computers_clock_change_nothing(self):
        clock = PublisherClock(lambda: 100 * S)
        clock.note(100 * S - 300_000_000)
        assert clock.now_ns() == 100 * S

    def test_stamps_of_another_clock_move_the_present_by_the_least_delay(self):
        now = [100 * S]
        clock = PublisherClock(lambda: now[0])
        for delay in (30, 5, 20):
            clock.note(7 * S - delay)
        assert clock.now_ns() == 7 * S - 5
        now[0] += S
        assert clock.now_ns() == 8 * S - 5
        clock.restart()
        clock.note(now[0] - 1)
        assert clock.now_ns() == now[0]
