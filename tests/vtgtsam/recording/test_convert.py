# SPDX-License-Identifier: MIT
"""Bags written by the rosbags library become recordings that say the same without a map."""

import sys

import numpy as np
import pytest
from foreign_bags import MAP, T_WC, WRITERS, Bag, store
from robot_log import send, write_log
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from sequences import HAND_XML, pose

from vtgtsam import cli, evaluate, read_recording
from vtgtsam.commands.convert import _counted
from vtgtsam.exceptions import RecordingError
from vtgtsam.recording import RecordingWriter
from vtgtsam.recording.bags import open_source
from vtgtsam.recording.convert import convert_bag


@pytest.fixture
def topic_map(tmp_path):
    (tmp_path / "hand.xml").write_text(HAND_XML)
    (tmp_path / "map.yaml").write_text(MAP)
    return tmp_path / "map.yaml"


@pytest.mark.parametrize("kind", WRITERS)
def test_a_converted_bag_says_what_the_bag_said_through_the_map(tmp_path, topic_map, kind):
    bag = WRITERS[kind](tmp_path / "bag")
    converted = convert_bag(bag, tmp_path / "out.mcap", topics=topic_map)
    before = read_recording(bag, topics=topic_map)
    after = read_recording(tmp_path / "out.mcap")
    assert converted.counts["visual poses"] == 28
    assert converted.counts["contacts"] == converted.counts["joint states"] == 100
    assert (after.hand.name, after.object.name) == ("gripper", "ball")
    frames = zip(before.measurements(), after.measurements(), strict=True)
    for expected, actual in frames:
        assert actual.time == pytest.approx(expected.time, abs=1e-9)
        np.testing.assert_allclose(
            actual.T_wo_visual.matrix(), expected.T_wo_visual.matrix(), atol=1e-12
        )
        np.testing.assert_allclose(actual.T_wh.matrix(), expected.T_wh.matrix(), atol=1e-12)
        np.testing.assert_array_equal(actual.joints, expected.joints)
        np.testing.assert_array_equal(actual.contacts, expected.contacts)
    assert after.camera_pose.equals(T_WC, 1e-9)
    assert after.truth_at([0.25])[0].x() == pytest.approx(0.25)
    assert [
        w for w in after.warnings if "touches while it is 8 mm" not in w
    ] == []  # made up, it does


@pytest.mark.parametrize(("force", "code"), [([], 1), (["--force"], 0)])
def test_a_file_that_is_there_is_replaced_only_by_force(
    tmp_path, topic_map, monkeypatch, capsys, force, code
):
    bag, out = WRITERS["rosbag2 sqlite3"](tmp_path / "bag"), tmp_path / "out.mcap"
    out.write_bytes(b"mine")
    arguments = ["convert", str(bag), "--topics", str(topic_map), "--out", str(out), *force]
    monkeypatch.setattr(sys, "argv", ["vtgtsam", *arguments])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert (stopped.value.code or 0) == code
    assert (out.read_bytes() == b"mine") == (not force)
    assert force or "is there already; give another name, or --force" in capsys.readouterr().err


def test_one_message_is_not_called_many():
    assert _counted("true poses", 1) == "1 true pose"
    assert _counted("poses of the hand", 2) == "2 poses of the hand"


def test_the_command_says_what_it_wrote_and_the_result_is_evaluated(
    tmp_path, topic_map, monkeypatch, capsys
):
    bag, out = WRITERS["rosbag2 sqlite3"](tmp_path / "bag"), tmp_path / "out.mcap"
    arguments = ["convert", str(bag), "--topics", str(topic_map), "--out", str(out)]
    monkeypatch.setattr(sys, "argv", ["vtgtsam", *arguments])
    with pytest.raises(SystemExit) as stopped:
        cli.main()
    assert not stopped.value.code
    assert "28 visual poses" in capsys.readouterr().out
    methods = ["vis", "vis+tac+pen"]
    direct = evaluate(bag, methods, "tuned", tmp_path / "a", topics=topic_map)
    converted = evaluate(out, methods, "tuned", tmp_path / "b")
    columns = ["method", "phase", "adds_median_mm"]
    np.testing.assert_array_equal(direct[columns[:2]], converted[columns[:2]])
    np.testing.assert_allclose(
        direct[columns[2]].astype(float), converted[columns[2]].astype(float), atol=1e-9
    )


def _bag(path, fill):
    with Writer2(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        fill(Bag(writer, store(), 2))
    return path


def _ohms(bag):
    """Pads of 1000 and 2000 ohm that lose 300 and gain 400 when pressed with 6 N, from 2.5 s on."""
    for k in range(400):
        t = 0.01 * k
        press = 0.5 if t >= 2.5 else 0.0
        bag.joints("/j", t, ["j_left", "j_right"], [0, 0])
        noise = 5 * (-1) ** k
        bag.array("/ohms", t, [1000 - 300 * press + noise, 2000 + 400 * press + noise], "Float64")
        bag.pose("/vision/object_pose", t, pose(0.1))


CALIBRATED = """
hand: hand.xml
object: ball
topics:
  joints: /j
  contacts:
    topic: /ohms
    names: [pad_left, pad_right]
    threshold: THRESHOLD
    calibration: {untouched: UNTOUCHED, drop: [300, -400]}
"""


def _calibrated(tmp_path, threshold=0.15, untouched=2.0, text=CALIBRATED):
    (tmp_path / "hand.xml").write_text(HAND_XML)
    text = text.replace("THRESHOLD", str(threshold)).replace("UNTOUCHED", str(untouched))
    (tmp_path / "map.yaml").write_text(text)
    return tmp_path / "map.yaml"


@pytest.mark.parametrize(("threshold", "pressed"), [(0.15, True), (0.45, True), (0.55, False)])
def test_raw_values_become_contacts_by_the_papers_calibration(tmp_path, threshold, pressed):
    bag = _bag(tmp_path / "bag", _ohms)
    convert_bag(bag, tmp_path / "out.mcap", topics=_calibrated(tmp_path, threshold))
    frames = read_recording(tmp_path / "out.mcap").measurements()
    for frame in frames:
        assert frame.contacts.tolist() == [pressed and frame.time >= 2.5] * 2


def test_a_pad_touched_during_its_baseline_is_refused(tmp_path):
    bag = _bag(tmp_path / "bag", _ohms)
    with pytest.raises(RecordingError, match="pad_left, pad_right changed in the first 4 s"):
        convert_bag(bag, tmp_path / "out.mcap", topics=_calibrated(tmp_path, untouched=4))
    assert not (tmp_path / "out.mcap").exists()


def test_a_calibration_that_does_not_fit_the_values_is_refused(tmp_path):
    bag = _bag(tmp_path / "bag", _ohms)
    three = _calibrated(tmp_path, text=CALIBRATED.replace("[300, -400]", "[300, -400, 1]"))
    with pytest.raises(RecordingError, match="2 values, the map 2 names and 3 drops"):
        convert_bag(bag, tmp_path / "out.mcap", topics=three)
    zero = _calibrated(tmp_path, text=CALIBRATED.replace("[300, -400]", "0"))
    with pytest.raises(RecordingError, match="must not be 0"):
        convert_bag(bag, tmp_path / "out.mcap", topics=zero)


def test_stamps_out_of_order_are_written_in_order(tmp_path, topic_map):
    def fill(bag):
        bag.pose("/robot/camera", 0.0, T_WC)
        for k in np.random.default_rng(0).permutation(100):
            t = 0.01 * float(k)
            bag.joints("/robot/joint_states", t, ["j_left", "j_right"], [t, -t], receive=5.0)
            bag.array("/skin/values", t, [0.2, 0.1])
            bag.pose("/foundationpose/pose", t + 0.06, T_WC.between(pose(t)), 6.0, "camera")

    bag = _bag(tmp_path / "bag", fill)
    convert_bag(bag, tmp_path / "out.mcap", topics=topic_map)
    recording = read_recording(tmp_path / "out.mcap")
    frames = recording.measurements()
    assert [f.time for f in frames] == pytest.approx([0.01 * k for k in range(100)], abs=1e-9)
    for frame in frames:
        np.testing.assert_allclose(frame.joints, [frame.time, -frame.time], atol=1e-12)
    assert recording.ground_truth is None


def test_what_was_logged_beyond_all_stamps_is_left_out_with_a_word(tmp_path, topic_map):
    def fill(bag):
        for k in range(100):
            t = 1.0 + 0.01 * k
            logged = 9e9 if k == 50 else t  # a bit of one log time has flipped
            bag.pose("/robot/camera", t, T_WC)
            bag.joints("/robot/joint_states", t, ["j_left", "j_right"], [t, -t])
            bag.array("/skin/values", t, [0.2, 0.1])
            bag.pose("/foundationpose/pose", t, T_WC.between(pose(t)), logged, "camera")

    converted = convert_bag(_bag(tmp_path / "bag", fill), tmp_path / "out.mcap", topics=topic_map)
    assert any(
        "1 message is left out: its instant or its log time" in w for w in converted.warnings
    )
    times = read_recording(tmp_path / "out.mcap").streams.vision.times_ns
    assert len(times) == 99 and 1_440_000_000 not in times  # the map says that it is 60 ms late


@pytest.mark.parametrize(
    ("missing", "sentence"),
    [
        ("/robot/joint_states", r"no topic /robot/joint_states \(joint angles\)"),
        ("/skin/values", r"no topic /skin/values \(contacts\)"),
    ],
)
def test_a_bag_without_a_needed_stream_is_refused_in_one_sentence(
    tmp_path, topic_map, missing, sentence
):
    class Deaf(Bag):
        def write(self, topic, *rest):
            if topic != missing:
                super().write(topic, *rest)

    from foreign_bags import fill

    with Writer2(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        fill(Deaf(writer, store(), 2))
    with pytest.raises(RecordingError, match=sentence) as refused:
        convert_bag(tmp_path / "bag", tmp_path / "out.mcap", topics=topic_map)
    assert "\n" not in str(refused.value)
    assert not list(tmp_path.glob("*out.mcap*"))


def test_a_bag_without_visual_poses_or_truth_is_converted_all_the_same(tmp_path, topic_map):
    def fill(bag):
        for k in range(50):
            bag.joints("/robot/joint_states", 0.01 * k, ["j_left", "j_right"], [0, 0])
            bag.array("/skin/values", 0.01 * k, [0.2, 0.1])

    convert_bag(_bag(tmp_path / "bag", fill), tmp_path / "out.mcap", topics=topic_map)
    recording = read_recording(tmp_path / "out.mcap")
    assert recording.visual_poses is None
    assert len(recording.measurements(rate=50)) == 25


def test_a_bag_is_not_written_over(tmp_path, topic_map):
    bag = WRITERS["ROS 1"](tmp_path / "bag")
    content = bag.read_bytes()
    with pytest.raises(RecordingError, match="is the bag itself"):
        convert_bag(bag, bag, topics=topic_map)
    assert bag.read_bytes() == content


def test_resolution_and_symmetry_of_an_object_go_into_the_recording(
    tmp_path, topic_map, monkeypatch, capsys
):
    bag = next(iter(WRITERS.values()))(tmp_path / "bag")
    out = tmp_path / "out.mcap"
    arguments = ["vtgtsam", "convert", str(bag), "--topics", str(topic_map), "--out", str(out)]
    more = ["--object", "ball", "--resolution", "24", "--symmetry", "z"]
    monkeypatch.setattr(sys, "argv", arguments + more)
    with pytest.raises(SystemExit) as done:
        cli.main()
    assert not done.value.code
    obj = read_recording(out).object
    assert obj.sdf.values.shape == (24, 24, 24)
    assert obj.symmetry["symmetries_continuous"][0]["axis"] == [0, 0, 1]
    monkeypatch.setattr(sys, "argv", [*arguments, "--force", "--symmetry", "z"])
    with pytest.raises(SystemExit) as done:
        cli.main()
    assert done.value.code == 2 and "goes with --object" in capsys.readouterr().err


def test_what_became_known_when_stays_known_by_the_clock_of_the_stamps(tmp_path):
    """A tracker that needs 0.2 s, recorded by a computer whose clock is an hour ahead."""

    def change(log, topic, t, what):
        late = 0.2 if topic == "/vision/object_pose" else 0.0
        return send(log, topic, t, received=t + 3600.0 + late, **what)

    convert_bag(write_log(tmp_path / "a.mcap", change), tmp_path / "b.mcap")
    after = read_recording(tmp_path / "b.mcap")
    assert after.info["visual_covariance"] == "tracker"
    vision, truth = after.streams.vision, after.streams.truth
    np.testing.assert_allclose(vision.received_ns - vision.times_ns, 2 * 10**8, atol=1)
    np.testing.assert_allclose(truth.received_ns - truth.times_ns, 0, atol=1)
    logged = [message.receive_ns for message in open_source(tmp_path / "b.mcap").messages()]
    assert logged == sorted(logged)


def test_old_simulated_recordings_have_the_cameras_error_in_their_covariances(tmp_path):
    for info, expected in (
        ({"calibration_error": "yes"}, True),
        ({"calibration_error": "yes", "visual_covariance": "tracker"}, False),
        ({}, False),
    ):
        with RecordingWriter(tmp_path / "a.mcap", info) as writer:
            writer.joint_states(0.0, ["a"], [0.0], received=0.5)
        recording = read_recording(tmp_path / "a.mcap")
        assert recording.covariance_holds_camera is expected
        assert recording.streams.joints.arrivals.delay == 0.5
