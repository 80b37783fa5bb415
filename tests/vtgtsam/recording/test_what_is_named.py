# SPDX-License-Identifier: MIT
"""What is read is what was named, in every command: a file that file, a folder the bag that it says it is."""

import bz2
import gzip
import shutil

import numpy as np
import pytest
import yaml
from foreign_bags import write_ros1, write_ros2
from robot_log import RobotLog, write_log
from rosbags.rosbag2 import StoragePlugin
from sequences import write_sequence

from vtgtsam.evaluation.find import find_recordings
from vtgtsam.exceptions import RecordingError
from vtgtsam.recording import read_recording
from vtgtsam.recording.bags import open_source
from vtgtsam.recording.convert import convert_bag
from vtgtsam.recording.inspect import inspect_recording


def piece(path, start, seconds=1.0, name="base"):
    """A piece of a bag as `ros2 bag record -d` cuts it: nothing in it says so."""
    with RobotLog(path) as log:
        for k in range(round(20 * seconds)):
            log.joints(start + 0.05 * k, np.zeros(1), [f"j_{name}"])
    return path


def pieces(folder, count=3, name="run", first=0, gap=0.05):
    folder.mkdir(exist_ok=True)
    for k in range(first, first + count):
        piece(folder / f"{name}_{k}.mcap", 100 + k * (0.95 + gap))
    return folder


def describe(folder, files, storage="mcap"):
    about = {"version": 5, "storage_identifier": storage, "relative_file_paths": files}
    (folder / "metadata.yaml").write_text(yaml.safe_dump({"rosbag2_bagfile_information": about}))


def stamps(path):
    return [round(message.receive_ns / 1e9, 2) for message in open_source(path).messages()]


@pytest.mark.parametrize("first", [0, 8])
def test_pieces_whose_times_follow_each_other_are_one_recording_in_every_command(tmp_path, first):
    folder = pieces(tmp_path / "bag", first=first)
    assert stamps(folder) == sorted(stamps(folder))  # run_9 comes before run_10
    assert len(stamps(folder)) == 60
    assert list(find_recordings([folder])) == ["bag"]
    assert list(find_recordings([tmp_path])) == ["bag"]
    (stream,) = inspect_recording(folder).streams
    assert stream.count == 60


def test_recordings_that_are_merely_numbered_are_each_their_own(tmp_path):
    folder = tmp_path / "takes"
    pieces(folder, gap=30.0)  # half a minute between two takes
    assert list(find_recordings([folder])) == ["run_0", "run_1", "run_2"]
    for act in (read_recording, open_source, lambda f: convert_bag(f, tmp_path / "out.mcap")):
        with pytest.raises(RecordingError, match="holds 3 recordings .* give one of them"):
            act(folder)


def test_our_own_recordings_are_complete_whatever_they_are_called(tmp_path):
    for k in range(3):
        write_sequence(tmp_path / f"mug_{k}.mcap", seconds=1.0, start=1.0 + k)
    assert list(find_recordings([tmp_path])) == ["mug_0", "mug_1", "mug_2"]


def test_unrelated_recordings_in_one_folder_are_never_fused(tmp_path):
    folder = tmp_path / "eight"
    folder.mkdir()
    for k in range(8):
        piece(folder / f"{'abcdefgh'[k]}.mcap", 100 + k)
    with pytest.raises(RecordingError, match=r"holds 8 recordings \(a.mcap, b.mcap, c.mcap, ...\)"):
        convert_bag(folder, tmp_path / "out.mcap")
    assert len(find_recordings([folder])) == 8


def test_pieces_beside_other_recordings_are_refused(tmp_path):
    folder = pieces(tmp_path / "bag")
    piece(folder / "other.mcap", 500)
    with pytest.raises(RecordingError, match="run_0.mcap, run_1.mcap, run_2.mcap in .* own"):
        find_recordings([tmp_path])


def test_metadata_says_which_files_are_the_bag(tmp_path):
    folder = pieces(tmp_path / "bag", count=2)
    piece(folder / "calibration.mcap", 50)
    describe(folder, ["bag/run_1.mcap"])  # older versions name the folder too
    assert min(stamps(folder)) == 101.0
    assert len(stamps(folder)) == 20


def test_metadata_with_another_storage_is_obeyed_where_an_mcap_lies(tmp_path):
    bag = write_ros2(tmp_path / "bag", StoragePlugin.SQLITE3)
    piece(bag / "aside.mcap", 500)
    assert "/robot/wrist" in inspected(bag)
    (database,) = bag.glob("*.db3")
    assert "/robot/wrist" in inspected(database)
    assert inspected(bag / "aside.mcap") == ["/joint_states"]


def inspected(path):
    return [stream.topic for stream in inspect_recording(path).streams]


def test_a_missing_piece_is_named(tmp_path):
    folder = pieces(tmp_path / "bag")
    describe(folder, ["run_0.mcap", "run_1.mcap", "run_2.mcap"])
    (folder / "run_1.mcap").unlink()
    recording = read_recording(folder)
    assert recording.warnings == [
        "metadata.yaml lists run_1.mcap, which is not there: what it held is missing"
    ]
    shutil.rmtree(folder)
    folder.mkdir()
    describe(folder, ["run_0.mcap"])
    with pytest.raises(
        RecordingError, match="lists run_0.mcap, which is not there; copy the whole"
    ):
        open_source(folder)


@pytest.mark.parametrize("text", ["", "a: [", "rosbag2_bagfile_information: 3", "\xff\xfe", "- 1"])
def test_metadata_that_makes_no_sense_is_one_sentence(tmp_path, text):
    folder = pieces(tmp_path / "bag")
    (folder / "metadata.yaml").write_bytes(text.encode("latin-1"))
    with pytest.raises(RecordingError, match="is no description of a rosbag2 bag") as error:
        open_source(folder)
    assert "\n" not in str(error.value)
    assert "ros2 bag reindex" in str(error.value)


def test_a_database_without_metadata_is_read(tmp_path):
    bag = write_ros2(tmp_path / "bag", StoragePlugin.SQLITE3)
    (bag / "metadata.yaml").unlink()
    (database,) = bag.glob("*.db3")
    for path in (bag, database):
        assert "/robot/wrist" in inspected(path)


def test_names_may_lie(tmp_path):
    """A ROS 1 bag named .mcap, one that was being written, an MCAP file without a suffix."""
    bag = write_ros1(tmp_path / "a")
    expected = inspected(bag)
    for name in ("b.mcap", "c.bag.active", "d"):
        assert inspected(shutil.copy(bag, tmp_path / name)) == expected
    recorded = write_log(tmp_path / "e.mcap")
    expected = inspected(recorded)
    for name in ("f.bag", "g.db3", "h"):
        assert inspected(shutil.copy(recorded, tmp_path / name)) == expected


OTHERS = {
    "zstd": (b"\x28\xb5\x2f\xfd" + bytes(20), "is compressed with zstd; type: zstd -d x"),
    "lz4": (b"\x04\x22\x4d\x18" + bytes(20), "is compressed with lz4; type: lz4 -d x"),
    "gzip": (gzip.compress(b"a"), "is compressed with gzip; type: gunzip x"),
    "bzip2": (bz2.compress(b"a"), "is compressed with bzip2"),
    "zip": (b"PK\x03\x04" + bytes(20), "is a zip archive"),
    "lfs": (
        b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n",
        "is a pointer of Git LFS, not the file; type: git lfs pull",
    ),
    "zeros": (bytes(100), "begins with zeros"),
    "nothing": (b"", "is empty"),
    "text": (b"hello", "is not a recording"),
}


@pytest.mark.parametrize("suffix", [".mcap", ".bag", ".db3", ".mcap.zstd", ""])
@pytest.mark.parametrize("kind", OTHERS)
def test_what_is_no_recording_is_told_by_how_it_begins(tmp_path, kind, suffix):
    content, words = OTHERS[kind]
    path = tmp_path / f"x{suffix}"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=words):
        read_recording(path)


def test_a_ros_1_bag_that_was_cut_off_says_how_to_mend_it(tmp_path):
    bag = write_ros1(tmp_path / "a")
    content = bag.read_bytes()
    for size in (len(content) // 2, 5000):
        bag.write_bytes(content[:size])
        with pytest.raises(RecordingError, match="type: rosbag reindex a.bag"):
            read_recording(bag)
