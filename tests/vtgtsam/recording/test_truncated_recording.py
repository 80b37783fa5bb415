# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sequences import HAND_XML, gripper, write_sequence

from vtgtsam.exceptions import RecordingError
from vtgtsam.recording import read_recording
from vtgtsam.recording.mcap_file import McapFile


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "a.mcap"
    return write_sequence(path, seconds=3.0, metadata={"object": "can"}, hand_xml=HAND_XML)


@pytest.fixture(scope="module")
def complete(whole):
    return read_recording(whole)


def joint_samples(recording):
    joints = recording._streams.joints
    return joints.columns["j_left"] if joints else (np.zeros(0), np.zeros(0))


@settings(max_examples=150, deadline=None)
@given(share=st.floats(0.0, 1.0, exclude_max=True))
def test_cut_anywhere_it_gives_a_prefix_and_says_so_once(whole, complete, tmp_path_factory, share):
    content = whole.read_bytes()
    cut = tmp_path_factory.mktemp("cut") / "cut.mcap"
    cut.write_bytes(content[: int(share * len(content))])
    try:
        recording = read_recording(cut)
    except RecordingError as error:  # so early that no message is left
        assert "\n" not in str(error)
        return
    times, values = joint_samples(recording)
    all_times, all_values = joint_samples(complete)
    np.testing.assert_array_equal(times, all_times[: len(times)])
    np.testing.assert_array_equal(values, all_values[: len(values)])
    (warning,) = recording.warnings
    assert "cut off" in warning
    lost = ("what was recorded after", "no message is left")
    assert len(times) == len(all_times) or any(words in warning for words in lost)
    assert recording.info["object"] == "can"
    assert recording.hand.pad_names == gripper().pad_names


def test_half_of_a_file_has_half_of_the_frames_and_the_warning_says_what_is_lost(whole, tmp_path):
    content = whole.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(content[: len(content) // 2])
    recording = read_recording(cut)
    (warning,) = recording.warnings
    assert warning.startswith("the file is cut off: its last ")
    assert f"of {len(content) // 2} bytes" in warning
    assert 10 < len(recording._streams.joints.times_ns) < 290


def test_a_file_without_any_message_left_is_not_called_used(whole):
    file = McapFile(whole.with_name("head.mcap"))
    file.path.write_bytes(whole.read_bytes()[:200])
    assert list(file.messages()) == []
    assert "no message is left" in file.warnings[0] and "is used" not in file.warnings[0]


def test_zeros_at_the_end_as_a_file_system_leaves_them_count_as_cut_off(whole, tmp_path):
    content = whole.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(content[: len(content) // 2] + bytes(5000))
    recording = read_recording(cut)
    assert "is cut off" in recording.warnings[0]


@settings(max_examples=100, deadline=None)
@given(share=st.floats(0.0, 1.0, exclude_max=True), bit=st.integers(0, 7))
def test_a_flipped_bit_never_gives_wrong_values(whole, complete, tmp_path_factory, share, bit):
    content = bytearray(whole.read_bytes())
    content[int(share * len(content))] ^= 1 << bit
    path = tmp_path_factory.mktemp("flipped") / "flipped.mcap"
    path.write_bytes(content)
    try:
        recording = read_recording(path)
    except RecordingError as error:
        assert "\n" not in str(error)
        return
    true = dict(zip(*joint_samples(complete), strict=True))
    for stamp, value in zip(*joint_samples(recording), strict=True):
        assert true[stamp] == value
    if len(joint_samples(recording)[0]) < len(true):
        assert len(recording.warnings) == 1


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty; expected an .mcap file"),
        (b"not a recording", "is not a recording; expected an .mcap file"),
        (b"\x89MCAP0\r\n", "holds no messages"),
    ],
)
def test_a_file_without_anything_is_refused_in_one_sentence(tmp_path, content, message):
    (tmp_path / "a.mcap").write_bytes(content)
    with pytest.raises(RecordingError, match=message):
        read_recording(tmp_path / "a.mcap")
