# SPDX-License-Identifier: MIT
"""Bags that the rosbags library reads are unpacked no further than the limits."""

import bz2
import io

import lz4.frame
import numpy as np
import pytest
import zstandard

from vtgtsam.exceptions import RecordingError

pytest.importorskip("rosbags")

from vtgtsam.recording import rosbags_limits

SOUND = np.random.default_rng(0).integers(0, 256, 3_000_000, dtype=np.uint8).tobytes()


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setenv("VTGTSAM_LIMITS", "0.02")  # 5 MB a chunk, 21 MB a bag


@pytest.fixture
def unpack():
    from rosbags.rosbag1 import reader as ros1
    from rosbags.rosbag2 import reader as ros2

    rosbags_limits.keep_limits()
    return {
        "bz2": (bz2.compress, ros1.decompressors["bz2"]),
        "lz4": (lz4.frame.compress, ros1.decompressors["lz4"]),
        "zstd": (zstandard.compress, ros2.zstd.decompress),
    }


@pytest.mark.parametrize("kind", ["bz2", "lz4", "zstd"])
def test_a_chunk_is_unpacked_as_it_was_and_refused_beyond_the_limit(unpack, kind):
    pack, back = unpack[kind]
    for data in (b"", b"short", SOUND):
        assert back(pack(data)) == data
    with pytest.raises(RecordingError, match="unpacked, are more than"):
        back(pack(bytes(6_000_000)))


def test_a_compressed_bag_is_unpacked_as_it_was_and_refused_beyond_the_limit(unpack):
    with rosbags_limits._zstd_file(io.BytesIO(zstandard.compress(SOUND)), "rb") as file:
        assert file.read() == SOUND
    with rosbags_limits._zstd_file(io.BytesIO(zstandard.compress(bytes(30_000_000))), "rb") as file:
        with pytest.raises(RecordingError, match="unpacked, are more than"):
            file.read()
