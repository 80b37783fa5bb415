# SPDX-License-Identifier: MIT
from pathlib import Path

import pytest

from vtgtsam.evaluation.find import find_recordings
from vtgtsam.exceptions import RecordingError


def touch(*paths: Path) -> None:
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()


def test_ids_are_paths_below_the_given_folder(tmp_path):
    touch(tmp_path / "can" / "0.mcap", tmp_path / "box" / "deep" / "1.mcap", tmp_path / "notes.txt")
    assert list(find_recordings([tmp_path])) == ["box__deep__1", "can__0"]


def test_a_rosbag2_folder_is_one_recording_whatever_files_it_holds(tmp_path):
    touch(tmp_path / "bag" / "metadata.yaml", tmp_path / "bag" / "bag_0.mcap", tmp_path / "a.mcap")
    assert find_recordings([tmp_path]) == {"a": tmp_path / "a.mcap", "bag": tmp_path / "bag"}
    assert find_recordings([tmp_path / "bag"]) == {"bag": tmp_path / "bag"}


def test_a_folder_given_with_a_slash_or_a_dot_has_its_own_name(tmp_path, monkeypatch):
    touch(tmp_path / "bag" / "metadata.yaml")
    monkeypatch.chdir(tmp_path / "bag")
    assert list(find_recordings(["."])) == ["bag"]


def test_a_link_back_up_is_not_followed(tmp_path):
    touch(tmp_path / "a" / "0.mcap")
    (tmp_path / "a" / "up").symlink_to(tmp_path)
    (tmp_path / "b").symlink_to(tmp_path / "a")
    assert list(find_recordings([tmp_path])) == ["a__0", "b__0"]


def test_two_recordings_of_one_id_are_refused_and_named(tmp_path):
    touch(tmp_path / "x" / "0.mcap", tmp_path / "y" / "0.mcap")
    with pytest.raises(RecordingError, match=r"id '0'.*x/0\.mcap.*y/0\.mcap"):
        find_recordings([tmp_path / "x", tmp_path / "y"])


def test_one_recording_given_twice_is_one(tmp_path):
    touch(tmp_path / "0.mcap")
    assert len(find_recordings([tmp_path, tmp_path / "0.mcap"])) == 1


def test_what_does_not_exist_or_holds_nothing_is_said(tmp_path):
    with pytest.raises(RecordingError, match="missing does not exist"):
        find_recordings([tmp_path / "missing"])
    with pytest.raises(RecordingError, match=r"no recordings in .*expected \.mcap files"):
        find_recordings([tmp_path])
    with pytest.raises(RecordingError, match="no recordings given"):
        find_recordings([])
