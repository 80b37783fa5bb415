# SPDX-License-Identifier: MIT
"""Damage inside an MCAP file is told, never taken for an end; what can be read of it is."""

import numpy as np
import pytest
from mcap.writer import CompressionType
from robot_log import RobotLog, lifted, send, write_log

from vtgtsam.exceptions import RecordingError
from vtgtsam.recording import names, read_recording
from vtgtsam.recording.inspect import inspect_recording
from vtgtsam.recording.mcap_file import McapFile

CHUNK = 6


def write(path, **options):
    """400 samples of two joints in several chunks."""
    with RobotLog(path, {"object": "box", "object_scale": "1.0"}, **options) as log:
        for k in range(400):
            log.joints(0.01 * k, np.array([k, -k]), ("left", "right"))
    return path


def records(content):
    """Offset and opcode of each record."""
    place = 8
    while place + 9 <= len(content) - 8:
        yield place, content[place]
        place += 9 + int.from_bytes(content[place + 1 : place + 9], "little")


def samples(path):
    file = McapFile(path)
    return sum(1 for _ in file.messages()), file.warnings


@pytest.mark.parametrize("opcode", [0x0F, 0x07, 0x80, 0x05, 0x0D, 0x02])
@pytest.mark.parametrize("which", [0, 1, -1])
def test_a_chunk_under_another_opcode_is_missed(tmp_path, opcode, which):
    path = write(tmp_path / "a.mcap", chunk_size=4096)
    content = bytearray(path.read_bytes())
    chunks = [place for place, code in records(content) if code == CHUNK]
    assert len(chunks) > 5
    content[chunks[which]] = opcode
    path.write_bytes(content)
    count, warnings = samples(path)
    assert 300 < count < 400  # the others are there, before and after it
    (warning,) = warnings
    assert "the file is damaged" in warning
    assert str(400) in warning or "bytes cannot be read" in warning
    assert inspect_recording(path).problems[0] == warning


def test_data_after_the_end_of_data_are_read_too(tmp_path):
    path = write(tmp_path / "a.mcap", chunk_size=4096)
    content = path.read_bytes()
    chunks = [place for place, code in records(content) if code == CHUNK]
    end = bytes([0x0F]) + (4).to_bytes(8, "little") + bytes(4)
    path.write_bytes(content[: chunks[2]] + end + content[chunks[2] :])
    assert samples(path)[0] == 400


def test_a_byte_of_the_metadata_that_changed_is_noticed(tmp_path):
    path = write_log(tmp_path / "a.mcap")
    rewritten = tmp_path / "b.mcap"
    from vtgtsam.recording.convert import convert_bag

    convert_bag(path, rewritten)
    content = rewritten.read_bytes()
    assert read_recording(rewritten).warnings == []
    assert content.count(b"object_scale\x03\x00\x00\x001.0") == 1
    doubled = content.replace(
        b"object_scale\x03\x00\x00\x001.0", b"object_scale\x03\x00\x00\x002.0"
    )
    rewritten.write_bytes(doubled)
    (warning,) = read_recording(rewritten).warnings
    assert "its checksum is another" in warning
    assert "do not trust what it says of hand and object" in warning


@pytest.mark.parametrize("compression", CompressionType)
def test_a_single_chunk_that_is_cut_gives_its_readable_part(tmp_path, compression):
    path = write(tmp_path / "a.mcap", chunk_size=2**30, compression=compression)
    content = path.read_bytes()
    (place,) = (place for place, code in records(content) if code == CHUNK)
    length = int.from_bytes(content[place + 1 : place + 9], "little")
    path.write_bytes(content[: place + int(0.6 * length)])
    count, (warning,) = samples(path)
    if compression == CompressionType.NONE:
        assert 230 < count < 250
    assert "the file is cut off" in warning
    assert count == 0 or "what was recorded after" in warning


def test_a_cut_chunk_of_many_blocks_gives_what_lies_before_the_cut(tmp_path):
    path = tmp_path / "a.mcap"
    rng = np.random.default_rng(0)
    for compression in (CompressionType.ZSTD, CompressionType.LZ4):
        with RobotLog(path, chunk_size=2**30, compression=compression) as log:
            for k in range(20000):
                log.joints(0.001 * k, rng.normal(size=2), ("left", "right"))
        content = path.read_bytes()
        path.write_bytes(content[: int(0.5 * len(content))])
        assert 5000 < samples(path)[0] < 20000


def cut(log, topic, t, what):
    """What ``send`` would write, cut in half."""
    before = log.raw
    log.raw = lambda topic, msgtype, data, received, **k: before(
        topic, msgtype, data[: len(data) // 2], received, **k
    )
    try:
        return send(log, topic, t, **what)
    finally:
        log.raw = before


@pytest.mark.parametrize("topic", [names.JOINTS, names.CONTACTS, names.TRUTH, names.VISION])
def test_a_message_cut_in_half_costs_itself(tmp_path, topic):
    def change(log, which, t, what):
        if which == topic and abs(t - 101.0) < 1e-6:
            return cut(log, which, t, what)

    path = write_log(tmp_path / "a.mcap", change)
    (warning,) = read_recording(path).warnings
    assert warning.startswith(
        f"topic {topic}: 1 of 150 messages are left out, they cannot be decoded"
    )
    found = inspect_recording(path)
    assert found.frames == (149 if topic == names.VISION else 150)
    assert found.problems == [warning]


def test_a_joint_that_is_never_a_number_costs_itself(tmp_path):
    """What ros2_control sends for a wheel without an encoder."""

    def change(log, topic, t, what):
        if topic == names.JOINTS:
            names_ = [*(f"j_{name}" for name in ("pad_xp", "pad_xn", "pad_yp", "pad_yn")), "wheel"]
            log.joints(t, [*what["values"], np.nan], names_)
            return True

    recording = read_recording(write_log(tmp_path / "a.mcap", change))
    assert len(recording.measurements()) == 150
    assert recording.warnings == [
        "topic /joint_states: 150 of 150 values of wheel are left out, they are not finite"
    ]


def test_a_second_publisher_without_positions_costs_its_messages(tmp_path):
    def change(log, topic, t, what):
        if topic == names.JOINTS and round(t / 0.02) % 50 == 0:
            log.joints(t + 0.001, [], ("wheel",))

    recording = read_recording(write_log(tmp_path / "a.mcap", change))
    assert len(recording.measurements()) == 150
    (warning,) = recording.warnings
    assert "3 of 153 messages are left out, they have no value for each of their names" in warning


def test_a_topic_none_of_whose_messages_can_be_decoded_is_refused(tmp_path):
    def change(log, topic, t, what):
        if topic == names.JOINTS:
            return cut(log, topic, t, what)

    with pytest.raises(RecordingError, match="topic /joint_states cannot be decoded"):
        read_recording(write_log(tmp_path / "a.mcap", change))


def test_a_pose_that_never_moves_holds_both_ways_however_often_it_was_sent(tmp_path):
    def change(log, topic, t, what):
        if topic == names.HAND_POSE:
            if any(abs(t - sent) < 1e-6 for sent in (101.0, 102.0)):
                send(log, topic, t, lifted(0.0))
            return True
        if topic in (names.TRUTH, names.VISION):
            return send(log, topic, t, lifted(0.0))

    recording = read_recording(write_log(tmp_path / "a.mcap", change))
    assert len(recording.measurements()) == 150
    assert recording.warnings == []


def test_a_singular_covariance_is_said_not_to_be_used(tmp_path):
    """A mobile base knows nothing of height, roll and pitch and says 0."""
    from vtgtsam.recording import messages

    planar = np.diag([1e-4, 1e-4, 0.0, 0.0, 0.0, 1e-3])

    def change(log, topic, t, what):
        if topic == names.VISION:
            pose = {
                "pose": messages.pose_fields(what["values"]),
                "covariance": planar.ravel().tolist(),
            }
            log.message(topic, messages.POSE_WITH_COVARIANCE, t, {"pose": pose})
            return True

    recording = read_recording(write_log(tmp_path / "a.mcap", change))
    (warning,) = recording.warnings
    assert "the covariances of 150 of 150 poses are not used, they are singular" in warning
    assert recording.measurements()[0].visual_covariance is None
