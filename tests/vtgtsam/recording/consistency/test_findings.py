# SPDX-License-Identifier: MIT
"""Streams that contradict each other are told, in fixed words; sound ones are not."""

import gtsam
import numpy as np
import pytest
from held_box import HAND_XML
from robot_log import lifted, send, write_log

from vtgtsam.recording import names, read_recording
from vtgtsam.recording.convert import convert_bag
from vtgtsam.recording.inspect import inspect_recording


def findings(path, **options):
    return read_recording(path, **options).findings


def what(path, **options):
    return [finding.what for finding in findings(path, **options)]


def test_a_sound_log_has_none_and_no_warning(tmp_path):
    recording = read_recording(write_log(tmp_path / "a.mcap"))
    recording.measurements()
    assert recording.findings == []
    assert recording.warnings == []
    assert inspect_recording(tmp_path / "a.mcap").problems == []


def test_every_command_says_the_same(tmp_path):
    """No hand pose, as where it is only in /tf: the hand would sit at the origin."""

    def change(log, topic, t, what):
        if topic == names.HAND_POSE:
            log.raw(
                "/tf", "tf2_msgs/msg/TFMessage", b"", t, text=b"geometry_msgs/TransformStamped[] t"
            )
            return True

    path = write_log(tmp_path / "a.mcap", change)
    (finding,) = findings(path)
    assert (finding.what, finding.level) == ("hand far from the object", "problem")
    assert "nearest of them is 3" in finding.sentence or "nearest of them is 4" in finding.sentence
    assert "there is no topic /hand/pose, so that the hand is taken to stand" in finding.sentence
    assert "what is only in /tf is not read: republish it" in finding.sentence
    recording = read_recording(path)
    recording.measurements()
    assert recording.warnings == [finding.sentence]
    assert inspect_recording(path).problems == [finding.sentence]
    assert convert_bag(path, tmp_path / "b.mcap").warnings == [finding.sentence]


def test_a_hand_in_another_frame_is_far_from_what_it_touches(tmp_path):
    away = gtsam.Pose3(gtsam.Rot3(), [0.0, 0.3, 0.0])

    def change(log, topic, t, what):
        if topic == names.HAND_POSE:
            return send(log, topic, t, away * what["values"])

    (finding,) = findings(write_log(tmp_path / "a.mcap", change))
    assert finding.what == "hand far from the object"
    assert "are hand and object given in one frame" in finding.sentence


def test_pads_that_touch_nothing_are_named(tmp_path):
    beside = gtsam.Pose3(gtsam.Rot3(), [0.0, -0.012, 0.0])

    def change(log, topic, t, what):
        if topic in (names.TRUTH, names.VISION):
            return send(log, topic, t, what["values"] * beside)

    found = findings(write_log(tmp_path / "a.mcap", change))
    assert [(f.what, f.about, f.level) for f in found] == [
        ("pad touches nothing", "pad_yp", "warning"),
        ("pad touches nothing", "pad_yn", "warning"),
    ]
    assert "pad pad_yp touches while it is 12 mm from the object" in found[0].sentence


def test_a_pad_that_touches_nothing_is_named_by_vision_too(tmp_path):
    """Its bits say so, but it is another finger's."""
    beside = gtsam.Pose3(gtsam.Rot3(), [0.0, -0.03, 0.0])

    def change(log, topic, t, what):
        if topic == names.TRUTH:
            return True
        if topic == names.VISION:
            return send(log, topic, t, what["values"] * beside)

    (finding,) = findings(write_log(tmp_path / "a.mcap", change))
    assert (finding.what, finding.about) == ("pad touches nothing", "pad_yp")
    assert "30 mm from the object (median, by the visual pose)" in finding.sentence


def test_a_pad_on_edge_looks_past_what_it_touches(tmp_path):
    """A plate 6 mm thick lies against the box, but +z points along it."""
    on_edge = HAND_XML.replace(
        'size="0.01 0.012 0.0001" zaxis="-1 0 0"',
        'pos="0.003 0 0" size="0.003 0.012 0.01" zaxis="0 1 0"',
    )
    assert on_edge != HAND_XML
    (tmp_path / "hand.xml").write_text(on_edge)
    (finding,) = findings(write_log(tmp_path / "a.mcap"), hand=tmp_path / "hand.xml")
    assert (finding.what, finding.about) == ("pad looks past what it touches", "pad_xp")
    assert "looks past what it touches by 90 degrees (median, by the true pose)" in finding.sentence


@pytest.mark.parametrize("period", [1, 2, 10])
def test_two_publishers_of_the_same_joints_are_noticed(tmp_path, period):
    def change(log, topic, t, what):
        if topic == names.JOINTS:
            send(log, topic, t, [0.5, 0.5, 0.0, 0.0])
            if round((t - 100) / 0.02) % period == 0:
                send(log, topic, t + 0.007, np.zeros(4))
            return True

    found = [f for f in findings(write_log(tmp_path / "a.mcap", change)) if "two" in f.what]
    assert [f.about for f in found] == ["j_pad_xp", "j_pad_xn"]
    assert found[0].level == "problem"
    assert "as where two programs publish it" in found[0].sentence


def test_two_publishers_of_the_hands_pose_or_of_pads_are_noticed(tmp_path):
    def change(log, topic, t, what):
        if topic == names.HAND_POSE:
            send(log, topic, t, **what)
            return send(log, topic, t + 0.004, gtsam.Pose3())
        if topic == names.CONTACTS:
            send(log, topic, t, **what)
            return send(log, topic, t + 0.009, [0, 1, 1, 1])

    found = findings(write_log(tmp_path / "a.mcap", change))
    about = [f.about for f in found if f.what == "two publishers of one name"]
    assert about == ["pad_xp", "/hand/pose"]


def test_zeros_of_a_second_program_exactly_between_are_noticed(tmp_path):
    def change(log, topic, t, what):
        if topic == names.CONTACTS:
            send(log, topic, t, **what)
            return send(log, topic, t + 0.01, [0, 0, 0, 0])

    found = findings(write_log(tmp_path / "a.mcap", change))
    about = [f.about for f in found if f.what == "two publishers of one name"]
    assert about == ["pad_xp", "pad_xn", "pad_yp", "pad_yn"]


@pytest.mark.parametrize("others", [(1, 1, 1), (0, 0, 0)], ids=["held by others", "alone"])
def test_a_box_that_rocks_against_a_pad_is_one_publisher(tmp_path, others):
    def change(log, topic, t, what):
        if topic == names.CONTACTS:
            jitter = np.random.default_rng(round(50 * t)).uniform(-3e-3, 3e-3)
            touches = round(50 * t) % 2
            return send(log, topic, t + jitter, [touches, *others])

    assert what(write_log(tmp_path / "a.mcap", change)) == []


def test_a_box_that_rocks_between_two_pads_is_one_publisher(tmp_path):
    def change(log, topic, t, what):
        if topic == names.CONTACTS:
            touches = round(50 * t) % 2
            return send(log, topic, t, [touches, 1 - touches, 0, 0])

    assert what(write_log(tmp_path / "a.mcap", change)) == []


@pytest.mark.parametrize(("ahead", "word"), [(0.3, "ahead of"), (-1.5, "behind")])
def test_a_trackers_clock_that_differs_from_the_others_is_noticed(tmp_path, ahead, word):
    def change(log, topic, t, what):
        if topic == names.VISION:  # true at t, received soon after, stamped by another clock
            return send(log, topic, t + ahead, received=t + 0.03, **what)
        return send(log, topic, t, received=t + 0.002, **what)

    (finding,) = (
        f for f in findings(write_log(tmp_path / "a.mcap", change)) if f.what == "clocks differ"
    )
    assert finding.about == names.VISION
    assert f"s {word} those of /joint_states" in finding.sentence
    assert "synchronise their clocks" in finding.sentence


def test_a_tracker_that_takes_its_time_is_none_and_neither_is_a_recorder_of_another_clock(tmp_path):
    def change(log, topic, t, what):
        slow = 0.25 if topic == names.VISION else 0.0
        return send(log, topic, t, received=t + 3600.0 + slow, **what)

    assert what(write_log(tmp_path / "a.mcap", change)) == []


def test_contacts_without_stamps_are_held_against_stamped_joints(tmp_path):
    """Receive times count for them, so that a robot's clock that is ahead separates the two."""

    def change(log, topic, t, what):
        if topic == names.CONTACTS:
            return send(log, topic, 0.0, received=t, **what)
        return send(log, topic, t + 0.4, received=t, **what)

    (finding,) = (
        f for f in findings(write_log(tmp_path / "a.mcap", change)) if f.what == "clocks differ"
    )
    assert finding.about == names.CONTACTS


def test_a_clock_that_is_set_back_in_the_middle_is_noticed(tmp_path):
    def change(log, topic, t, what):
        back = 0.5 if t >= 101.5 else 0.0
        return send(log, topic, t - back, received=t, **what)

    found = findings(write_log(tmp_path / "a.mcap", change))
    steps = [f for f in found if f.what == "clock steps back"]
    assert {f.about for f in steps} == {
        "/joint_states", "/tactile/contacts", "/hand/pose", "/vision/object_pose",
        "/truth/object_pose",
    }  # fmt: skip
    assert "step back by 0.48 s at 101.48 s" in steps[0].sentence
    assert steps[0].level == "problem"


def test_messages_that_came_late_are_no_clock_that_was_set(tmp_path):
    def change(log, topic, t, what):
        k = round((t - 100) / 0.02)
        if topic == names.JOINTS and 50 <= k < 60:  # ten of them two seconds late
            return True
        if topic == names.JOINTS and k == 100:
            for late in range(50, 60):
                send(log, topic, 100 + 0.02 * late, **what)

    assert "clock steps back" not in what(write_log(tmp_path / "a.mcap", change))


def test_frames_that_differ_are_told(tmp_path):
    frames = {names.HAND_POSE: "base_link", names.TRUTH: "optitrack", names.VISION: ""}

    def change(log, topic, t, what):
        if topic in frames:
            return send(log, topic, t, frame=frames[topic], **what)

    (finding,) = findings(write_log(tmp_path / "a.mcap", change))
    assert finding.what == "frames differ"
    assert "/hand/pose in 'base_link', /truth/object_pose in 'optitrack'" in finding.sentence


TURNS = {
    "rotations transposed": lambda T: gtsam.Pose3(T.rotation().inverse(), T.translation()),
    "w first": lambda T: _w_first(T),
    "axes are turned by 90 degrees about (1.00, 0.00, 0.00)": lambda T: (
        T * gtsam.Pose3(gtsam.Rot3.Rx(np.pi / 2), np.zeros(3))
    ),
}


def _w_first(T):
    x, y, z, w = T.rotation().toQuaternion().coeffs()
    return gtsam.Pose3(gtsam.Rot3.Quaternion(z, w, x, y), T.translation())


@pytest.mark.parametrize("words", TURNS)
def test_rotations_of_another_convention_are_noticed_and_explained(tmp_path, words):
    turned = gtsam.Rot3.RzRyRx(1.0, 0.4, 0.9)  # a box that stands askew, so that conventions differ

    def change(log, topic, t, what):
        T = lifted(t - 100)
        askew = gtsam.Pose3(T.rotation() * turned, T.translation())
        if topic == names.TRUTH:
            return send(log, topic, t, askew)
        if topic == names.CONTACTS:
            return send(log, topic, t, [0, 0, 0, 0])
        if topic == names.VISION:
            jitter = gtsam.Pose3.Expmap(np.random.default_rng(round(50 * t)).normal(0, 2e-3, 6))
            return send(log, topic, t, TURNS[words](askew) * jitter)

    (finding,) = findings(write_log(tmp_path / "a.mcap", change))
    assert finding.what == "vision turned from the truth"
    assert "; they agree with " in finding.sentence and words in finding.sentence


def test_a_box_seen_the_other_way_up_looks_the_same_and_is_none(tmp_path):
    def change(log, topic, t, what):
        if topic == names.VISION:
            return send(
                log, topic, t, what["values"] * gtsam.Pose3(gtsam.Rot3.Rx(np.pi), np.zeros(3))
            )

    assert what(write_log(tmp_path / "a.mcap", change)) == []


def test_a_flip_every_seventh_image_is_noticed(tmp_path):
    def change(log, topic, t, what):
        if topic == names.VISION and round((t - 100) / 0.02) % 7 == 0:
            return send(
                log, topic, t, what["values"] * gtsam.Pose3(gtsam.Rot3.Rx(np.pi), np.zeros(3))
            )

    (finding,) = findings(write_log(tmp_path / "a.mcap", change))
    assert finding.what == "vision flips"
    assert "back 21 times" in finding.sentence


def test_the_identity_that_a_lost_tracker_sends_is_no_pose(tmp_path):
    def change(log, topic, t, what):
        if topic in (names.VISION, names.TRUTH) and 101 < t < 101.8:
            return send(log, topic, t, gtsam.Pose3())

    recording = read_recording(write_log(tmp_path / "a.mcap", change))
    assert recording.warnings == [
        f"topic {topic}: 39 of 150 messages are left out, they are the identity, which is sent for no pose"
        for topic in (names.VISION, names.TRUTH)
    ]
    assert len(recording.measurements()) == 111


def test_the_last_pose_sent_again_while_the_hand_moves_is_no_pose(tmp_path):
    def change(log, topic, t, what):
        if topic == names.VISION and 101.2 < t < 102.6:
            return send(log, topic, t, lifted(1.2))

    recording = read_recording(write_log(tmp_path / "a.mcap", change))
    (warning,) = recording.warnings
    assert "repeat the pose before them to the last bit while the hand moves" in warning
    assert len(recording.visual_poses) < 90
    held = [m for m in recording.measurements(50) if 102.3 < m.time < 102.5]
    assert all(m.T_wo_visual is None for m in held)


def test_truth_that_stays_while_the_hand_moves_is_a_problem(tmp_path):
    def change(log, topic, t, what):
        if topic == names.TRUTH and t > 101.2:
            return send(log, topic, t, lifted(1.2))

    found = findings(write_log(tmp_path / "a.mcap", change))
    assert "truth repeats itself" in [f.what for f in found]


def test_a_box_at_rest_that_is_seen_without_noise_keeps_all_its_poses(tmp_path):
    def change(log, topic, t, what):
        if topic == names.VISION:
            return send(log, topic, t, lifted(t - 100))

    recording = read_recording(write_log(tmp_path / "a.mcap", change))
    assert len(recording.measurements()) == 150
    assert recording.warnings == []
