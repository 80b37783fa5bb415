# SPDX-License-Identifier: MIT
"""Recordings at URLs, in fsspec's stores that need no network, against the same ones in a folder."""

import hashlib
import json
import shutil
import sys
import tempfile
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq
import pytest
import yaml
from held_box import write_grasp

from vtgtsam import evaluate
from vtgtsam.evaluation.find import find_anywhere, find_recordings
from vtgtsam.exceptions import RecordingError, VtgtsamError

fsspec = pytest.importorskip("fsspec")

METHODS = ("vis", "vis+pen")


def content(path: Path) -> str:
    """Hash of a file; of one sequence's part without the key, which says where it came from."""
    if path.parent.name == "parts":
        return ""  # digests of files that hold the key
    if path.suffix != ".parquet" or path.name == "metrics.parquet":
        return hashlib.sha256(path.read_bytes()).hexdigest()
    table = pq.read_table(path)
    about = json.loads(table.schema.metadata[b"vtgtsam"])
    assert about.pop("key")
    return f"{about} {table.to_pylist()!r}"


def tree(folder: Path) -> dict[str, str]:
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {path.relative_to(folder).as_posix(): content(path) for path in files}


@pytest.fixture
def memory():
    """The store of this process, empty before and after."""
    store = fsspec.filesystem("memory")
    store.store.clear()
    store.pseudo_dirs[:] = [""]
    yield store
    store.store.clear()
    store.pseudo_dirs[:] = [""]


@pytest.fixture
def temporary(tmp_path, monkeypatch) -> Path:
    """Where this process and its workers put temporary files."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr(tempfile, "tempdir", None)
    return folder


@pytest.fixture(scope="module")
def grasps(tmp_path_factory) -> Path:
    """Two files and a rosbag2 folder of one file."""
    folder = tmp_path_factory.mktemp("grasps")
    write_grasp(folder / "day" / "0.mcap", seed=0, frames=6)
    write_grasp(folder / "1.mcap", seed=1, frames=6)
    write_grasp(folder / "day" / "bag" / "bag_0.mcap", seed=2, frames=6)
    about = {"version": 5, "storage_identifier": "mcap", "relative_file_paths": ["bag_0.mcap"]}
    described = yaml.safe_dump({"rosbag2_bagfile_information": about})
    (folder / "day" / "bag" / "metadata.yaml").write_text(described)
    (folder / "notes.txt").write_text("not a recording")
    return folder


@pytest.fixture(scope="module")
def expected(grasps, tmp_path_factory) -> dict[str, str]:
    out = tmp_path_factory.mktemp("out")
    assert evaluate(grasps, METHODS, "tuned", out).attrs["failed"] == {}
    return tree(out)


def left_behind(temporary: Path) -> list[Path]:
    return list(temporary.rglob("vtgtsam-*"))


def test_from_a_store_come_the_bytes_of_the_folder(grasps, expected, memory, tmp_path, temporary):
    memory.put(str(grasps), "/bucket/run", recursive=True)
    evaluate("memory://bucket/run", METHODS, "tuned", tmp_path / "out")
    assert tree(tmp_path / "out") == expected
    assert left_behind(temporary) == []


def test_two_processes_fetch_for_themselves(grasps, expected, tmp_path, temporary):
    evaluate(grasps.as_uri(), METHODS, "tuned", tmp_path / "out", jobs=2)
    assert tree(tmp_path / "out") == expected
    assert left_behind(temporary) == []


def test_what_the_store_marks_is_not_fetched_to_know_that_it_is_done(grasps, tmp_path, monkeypatch):
    from fsspec.implementations.local import LocalFileSystem

    source = tmp_path / "in"
    shutil.copytree(grasps, source)
    fetched, get_file = [], LocalFileSystem.get_file

    def watched(self, path, to, **options):
        fetched.append(Path(path).name)
        get_file(self, path, to, **options)

    monkeypatch.setattr(LocalFileSystem, "get_file", watched)
    monkeypatch.setattr(LocalFileSystem, "open", lambda *_: pytest.fail("read without need"))
    evaluate(source.as_uri(), ["vis"], "tuned", tmp_path / "out")
    assert sorted(fetched) == ["0.mcap", "1.mcap", "bag_0.mcap", "metadata.yaml"]
    fetched.clear()
    evaluate(source.as_uri(), ["vis"], "tuned", tmp_path / "out")
    assert fetched == []
    write_grasp(source / "1.mcap", seed=7, frames=6)
    evaluate(source.as_uri(), ["vis"], "tuned", tmp_path / "out")
    assert fetched == ["1.mcap"]


def test_what_the_store_does_not_mark_is_known_by_its_content(memory, tmp_path, monkeypatch):
    recording = write_grasp(tmp_path / "0.mcap", frames=4)
    memory.put_file(str(recording), "/bucket/0.mcap")
    fetched, get_file = [], type(memory).get_file

    def watched(self, path, to, **options):
        fetched.append(path)
        get_file(self, path, to, **options)

    monkeypatch.setattr(type(memory), "get_file", watched)
    for _ in range(2):
        evaluate("memory://bucket", ["vis"], "tuned", tmp_path / "out")
    assert len(fetched) == 1
    memory.put_file(str(write_grasp(recording, seed=3, frames=4)), "/bucket/0.mcap")
    evaluate("memory://bucket", ["vis"], "tuned", tmp_path / "out")
    assert len(fetched) == 2


@pytest.mark.parametrize("given", ["", "day", "day/bag", "day/0.mcap", "day/"])
def test_ids_are_those_of_the_folder(grasps, memory, given):
    memory.put(str(grasps), "/bucket/run", recursive=True)
    memory.pipe("/bucket/run10/other.mcap", b"")
    found = find_anywhere([f"memory://bucket/run/{given}"])
    assert list(found) == list(find_recordings([grasps / given]))


def test_a_bag_within_a_bag_belongs_to_the_outer_one(memory, tmp_path):
    for name in ("bag/metadata.yaml", "bag/bag_0.mcap", "bag/old/metadata.yaml", "bag/old/0.mcap"):
        memory.pipe(f"/bucket/{name}", b"")
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    (bag,) = find_anywhere(["memory://bucket"]).values()
    assert list(find_recordings([tmp_path])) == ["bag"]
    assert [file.name for file in bag.files] == ["bag_0.mcap", "metadata.yaml"]


def test_folders_and_stores_may_be_mixed_but_one_id_is_one_recording(grasps, memory):
    memory.put(str(grasps / "1.mcap"), "/bucket/2.mcap")
    assert list(find_anywhere([grasps / "1.mcap", "memory://bucket"])) == ["1", "2"]
    assert list(find_anywhere(["memory://bucket/2.mcap", "memory://bucket"])) == ["2"]
    memory.put(str(grasps / "1.mcap"), "/bucket/1.mcap")
    with pytest.raises(RecordingError, match=r"id '1': .*/1\.mcap and memory:///bucket/1\.mcap;"):
        find_anywhere([grasps / "1.mcap", "memory://bucket"])


def test_a_broken_recording_is_told_by_its_url_and_leaves_no_copy(memory, tmp_path, temporary):
    memory.pipe("/bucket/broken.mcap", b"this is no recording")
    evaluate("memory://bucket", ["vis"], "tuned", tmp_path / "out")
    (problem,) = pd.read_csv(tmp_path / "out" / "sequences.csv")["problem"]
    assert problem.startswith("memory:///bucket/broken.mcap is not a recording")
    assert left_behind(temporary) == []


def test_a_copy_that_is_not_whole_is_refused(memory, tmp_path, temporary, monkeypatch):
    memory.put_file(str(write_grasp(tmp_path / "0.mcap", frames=4)), "/bucket/0.mcap")
    monkeypatch.setattr(type(memory), "get_file", lambda _, __, to: Path(to).write_bytes(b"half"))
    summary = evaluate("memory://bucket", ["vis"], "tuned", tmp_path / "out")
    assert "changed while it was fetched: 0.mcap was listed" in summary.attrs["failed"]["0"]
    assert left_behind(temporary) == []


def test_what_disappears_after_it_was_listed_is_one_failed_sequence(memory, tmp_path, monkeypatch):
    import vtgtsam.evaluation.run as run

    memory.put_file(str(write_grasp(tmp_path / "0.mcap", frames=4)), "/bucket/0.mcap")
    memory.put_file(str(tmp_path / "0.mcap"), "/bucket/1.mcap")
    prepare = run._prepare
    monkeypatch.setattr(run, "_prepare", lambda *a: (prepare(*a), memory.rm("/bucket/1.mcap")))
    summary = evaluate("memory://bucket", ["vis"], "tuned", tmp_path / "out")
    assert "memory:///bucket/1.mcap cannot be read" in summary.attrs["failed"]["1"]
    assert list(summary.attrs["failed"]) == ["1"]


def test_what_is_not_there_is_said_in_one_sentence(memory, tmp_path, monkeypatch):
    memory.mkdir("/empty")
    monkeypatch.setitem(sys.modules, "s3fs", None)
    for url, problem in (
        ("memory://missing", "memory://missing does not exist"),
        ((tmp_path / "missing").as_uri(), "missing does not exist"),
        ("memory://empty", r"no recordings at memory://empty; expected \.mcap files"),
        ("nowhere://bucket", "nowhere://bucket cannot be opened .*Protocol not known: nowhere"),
        ("s3://bucket/run", "s3://bucket/run needs another package: Install s3fs"),
    ):
        with pytest.raises(RecordingError, match=problem) as error:
            find_anywhere([url])
        assert "\n" not in str(error.value)


def test_a_store_that_refuses_is_told_with_its_own_reason(memory, monkeypatch):
    def refuse(*_, **__):
        raise PermissionError("Access Denied")

    monkeypatch.setattr(type(memory), "find", refuse)
    with pytest.raises(RecordingError, match=r"bucket cannot be listed \(PermissionError: Access"):
        find_anywhere(["memory://bucket"])


def test_without_fsspec_one_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "fsspec", None)
    with pytest.raises(VtgtsamError, match=r"needs fsspec: pip install .*\[cluster\]'"):
        find_anywhere(["s3://bucket/run"])


def test_results_at_a_url_are_refused(grasps, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(VtgtsamError, match="results need a folder.*not s3://bucket/results"):
        evaluate(grasps, ["vis"], "tuned", "s3://bucket/results")
    assert list(tmp_path.iterdir()) == []


def test_the_command_takes_urls_as_they_are(tmp_path):
    from typer.testing import CliRunner

    from vtgtsam.cli import app

    arguments = ["evaluate", "file:///not/there", "--out", str(tmp_path / "out")]
    error = CliRunner().invoke(app, arguments).exception
    assert isinstance(error, RecordingError)
    assert str(error) == "file:///not/there does not exist"
