# SPDX-License-Identifier: MIT
"""Recordings from strangers: packed beyond measure, naming files of this machine, imitating our words."""

import struct
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import zstandard
from held_box import HAND_XML, PADS, write_grasp

from vtgtsam import VtgtsamError, read_recording
from vtgtsam.exceptions import RecordingError
from vtgtsam.recording import RecordingWriter
from vtgtsam.recording.frames import evaluation_frames
from vtgtsam.recording.inspect import inspect_recording

MESSAGE = struct.pack("<BQHIQQ", 5, 22, 0, 0, 0, 0)  # an empty one


def write_chunks(path: Path, *chunks: tuple[str, bytes, int]) -> Path:
    """An MCAP file of chunks: compression, content, and the size that they say they have."""
    with path.open("wb") as file:
        file.write(b"\x89MCAP0\r\n")
        for compression, data, size in chunks:
            name = compression.encode()
            body = struct.pack("<QQQI", 0, 0, size, 0) + struct.pack("<I", len(name)) + name
            body += struct.pack("<Q", len(data)) + data
            file.write(struct.pack("<BQ", 6, len(body)) + body)
    return path


def zeros(count: int) -> bytes:
    packer = zstandard.ZstdCompressor().compressobj()
    block = bytes(1 << 20)
    return b"".join(packer.compress(block) for _ in range(count)) + packer.flush()


def test_a_chunk_that_unpacks_to_a_gigabyte_is_refused(tmp_path):
    path = write_chunks(tmp_path / "a.mcap", ("zstd", zeros(1024), 1 << 30))
    with pytest.raises(RecordingError, match="bytes in a chunk, unpacked, are more than"):
        read_recording(path)


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_chunk_larger_than_it_says_is_not_unpacked_further(tmp_path, compression):
    data = zeros(300) if compression == "zstd" else lz4.frame.compress(bytes(300 << 20))
    path = write_chunks(tmp_path / "a.mcap", (compression, data, 1000))
    with pytest.raises(RecordingError, match="the file is cut off|damaged"):
        read_recording(path)


def test_many_chunks_in_a_small_file_are_refused_together(tmp_path):
    block = MESSAGE * 1000
    junk = struct.pack("<BQ", 0x80, 100 << 20) + bytes(100 << 20)
    packed = zstandard.compress(junk)
    path = write_chunks(tmp_path / "a.mcap", *[("zstd", packed, len(junk))] * 20)
    with pytest.raises(RecordingError, match="bytes, unpacked, are more than"):
        read_recording(path)
    assert len(block) == 31_000


def test_a_million_empty_messages_in_three_kilobytes_are_refused(tmp_path):
    many = MESSAGE * 1_000_000
    path = write_chunks(tmp_path / "a.mcap", ("zstd", zstandard.compress(many), len(many)))
    assert path.stat().st_size < 4000
    with pytest.raises(RecordingError, match="messages are more than"):
        read_recording(path)


def test_the_setting_raises_the_limit(tmp_path, monkeypatch):
    monkeypatch.setenv("VTGTSAM_LIMITS", "0.00001")
    path = write_grasp(tmp_path / "a.mcap", frames=20)
    with pytest.raises(RecordingError, match="are more than"):
        read_recording(path)
    monkeypatch.setenv("VTGTSAM_LIMITS", "1")
    assert len(read_recording(path).measurements()) == 20


@pytest.mark.parametrize("name", ["../secret.xml", "secret.xml", "{folder}/secret.xml"])
def test_a_recording_that_names_a_file_as_its_hand_does_not_get_it(tmp_path, monkeypatch, name):
    (tmp_path / "here").mkdir()
    for folder in (tmp_path, tmp_path / "here"):
        (folder / "secret.xml").write_text(HAND_XML)
    monkeypatch.chdir(tmp_path / "here")
    path = tmp_path / "a.mcap"
    with RecordingWriter(path, {"hand": name.format(folder=tmp_path)}) as writer:
        writer.joint_states(1.0, ["j"], np.zeros(1))
    with pytest.raises(RecordingError, match="the recording names its hand"):
        _ = read_recording(path).hand


def test_a_recording_that_names_a_file_as_its_object_does_not_get_it(tmp_path):
    mesh = tmp_path / "secret.obj"
    mesh.write_text("v 0 0 0\nv 0 0 1\nv 0 1 0\nf 1 2 3\n")
    path = tmp_path / "a.mcap"
    with RecordingWriter(path, {"object": str(mesh)}) as writer:
        writer.joint_states(1.0, ["j"], np.zeros(1))
    with pytest.raises(RecordingError, match="the recording names its object"):
        _ = read_recording(path).object


@pytest.mark.parametrize("suffix", [".zip", ".gltf", ".dae", ".tar.gz", ""])
def test_only_meshes_that_need_no_other_file_may_be_attached(tmp_path, suffix):
    path = tmp_path / "a.mcap"
    with RecordingWriter(path, {"object": "x"}, mesh=b"PK", mesh_suffix=suffix) as writer:
        writer.joint_states(1.0, ["j"], np.zeros(1))
    with pytest.raises(VtgtsamError, match="is attached as|neither a mesh file nor"):
        _ = read_recording(path).object


@pytest.mark.parametrize("symmetry", ["{", "[" * 50_000, "[1]", "9" * 5000])
def test_a_symmetry_that_is_none_is_one_sentence(tmp_path, symmetry):
    path = write_grasp(tmp_path / "a.mcap", frames=4, object_symmetry=symmetry)
    with pytest.raises(RecordingError, match="metadata 'object_symmetry'"):
        _ = read_recording(path).object


def test_an_attached_hand_that_is_no_text_is_one_sentence(tmp_path):
    path = tmp_path / "a.mcap"
    with RecordingWriter(path, {}) as writer:
        writer._attach("hand.xml", "application/xml", HAND_XML.encode("utf-16"))
        writer.joint_states(1.0, ["j"], np.zeros(1))
    with pytest.raises(VtgtsamError, match="the hand attached to the recording"):
        _ = read_recording(path).hand


def test_text_of_a_recording_cannot_imitate_ours(tmp_path):
    forged = {
        "trial": "0\n  no problems found",
        "problem": "none at all",
        "x\r\n  note: all is well": "y\x1b[2K",
    }
    path = write_grasp(tmp_path / "a.mcap", frames=4, dataset="d" * 5000, **forged)
    lines = list(inspect_recording(path).lines())
    assert all(line.isprintable() for line in lines)
    assert r"  trial: 0\n  no problems found" in lines
    assert "  'problem': none at all" in lines
    assert not any(line.startswith("  note: all is well") for line in lines)
    assert max(map(len, lines)) < 2100


@pytest.mark.parametrize("late", [3600.0, 1e5, 1e9])
def test_one_message_stamped_late_makes_no_frames_up_to_it(tmp_path, late):
    path = write_grasp(tmp_path / "a.mcap", frames=40, silent=(20, 40))
    whole = len(evaluation_frames(read_recording(path)))
    assert whole == 40
    with RecordingWriter(tmp_path / "late.mcap", {}, hand_xml=HAND_XML) as writer:
        _grasp_with_late_joints(writer, late)
    recording = read_recording(tmp_path / "late.mcap")
    assert whole - 1 <= len(evaluation_frames(recording)) <= whole
    assert any("nothing was recorded from" in warning for warning in recording.warnings)


def _grasp_with_late_joints(writer: RecordingWriter, late: float) -> None:
    import gtsam

    for k in range(40):
        t = 1.0 + 0.033 * k
        writer.joint_states(t, [f"j_{name}" for name in PADS], np.zeros(4))
        writer.tactile(t, PADS, np.full(4, 0.5), np.ones(4))
        writer.hand_pose(t, gtsam.Pose3())
        if k < 20:
            writer.object_pose(t, gtsam.Pose3())
    writer.joint_states(t + late, [f"j_{name}" for name in PADS], np.zeros(4))
