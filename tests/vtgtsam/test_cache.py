# SPDX-License-Identifier: MIT
import logging
import os
import threading
from pathlib import Path

import numpy as np
import pytest

from vtgtsam.cache import cache_directory, cached_arrays


@pytest.fixture
def cache(monkeypatch, tmp_path):
    monkeypatch.setenv("VTGTSAM_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


class Counting:
    """Computes an array and counts how often."""

    def __init__(self, size=5):
        self.calls = 0
        self.size = size

    def __call__(self):
        self.calls += 1
        return {"squares": np.arange(self.size) ** 2, "words": np.array(["a", "bc"])}


def test_second_call_reads_what_the_first_computed(cache):
    compute = Counting()
    first = cached_arrays("kind", "key", compute)
    second = cached_arrays("kind", "key", compute)
    assert compute.calls == 1
    np.testing.assert_array_equal(first["squares"], second["squares"])
    assert second["words"].tolist() == ["a", "bc"]
    assert [path.name for path in (cache / "kind").iterdir()] == ["key.npz"]


def test_other_key_and_other_kind_are_computed(cache):
    compute = Counting()
    for kind, key in (("kind", "key"), ("kind", "other"), ("other", "key")):
        cached_arrays(kind, key, compute)
    assert compute.calls == 3


@pytest.mark.parametrize("damage", ["cut", "empty", "flipped", "foreign"])
def test_damaged_file_is_made_anew_with_one_line_in_the_log(cache, caplog, damage):
    compute = Counting(1000)
    expected = cached_arrays("kind", "key", compute)["squares"]
    path = cache / "kind" / "key.npz"
    good = path.read_bytes()
    middle = len(good) // 2
    path.write_bytes(
        {
            "cut": good[:middle],
            "empty": b"",
            "flipped": good[:middle] + bytes([good[middle] ^ 1]) + good[middle + 1 :],
            "foreign": b"not an archive",
        }[damage]
    )
    with caplog.at_level(logging.WARNING, logger="vtgtsam"):
        found = cached_arrays("kind", "key", compute)["squares"]
    np.testing.assert_array_equal(found, expected)
    assert compute.calls == 2
    assert len(caplog.records) == 1 and "key.npz" in caplog.text
    assert path.read_bytes() == good


def test_no_single_damaged_byte_gets_through(cache, monkeypatch):
    monkeypatch.setattr("vtgtsam.cache.logger.warning", lambda *args: None)
    expected = cached_arrays("kind", "key", Counting())
    path = cache / "kind" / "key.npz"
    good = path.read_bytes()
    rng = np.random.default_rng(0)
    for place in [*rng.integers(len(good), size=60), *range(len(good) - 250, len(good))]:
        path.write_bytes(good[:place] + bytes([good[place] ^ 0x21]) + good[place + 1 :])
        found = cached_arrays("kind", "key", Counting())
        assert found.keys() == expected.keys()
        for name in expected:
            np.testing.assert_array_equal(found[name], expected[name])


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may write anywhere")
def test_folder_that_cannot_be_written_costs_one_line_in_the_log(monkeypatch, tmp_path, caplog):
    tmp_path.chmod(0o500)
    monkeypatch.setenv("VTGTSAM_CACHE", str(tmp_path / "cache"))
    with caplog.at_level(logging.WARNING, logger="vtgtsam"):
        assert cached_arrays("kind", "key", Counting())["squares"][2] == 4
    assert len(caplog.records) == 1 and "VTGTSAM_CACHE" in caplog.text


def test_file_in_place_of_the_folder_costs_one_line_in_the_log(monkeypatch, tmp_path, caplog):
    (tmp_path / "cache").write_text("")
    monkeypatch.setenv("VTGTSAM_CACHE", str(tmp_path / "cache"))
    with caplog.at_level(logging.WARNING, logger="vtgtsam"):
        assert cached_arrays("kind", "key", Counting())["squares"][2] == 4
    assert len(caplog.records) == 1 and "VTGTSAM_CACHE" in caplog.text


def test_error_while_computing_leaves_nothing_behind(cache):
    def fail():
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        cached_arrays("kind", "key", fail)
    assert not list(cache.rglob("*.*"))


def test_writers_and_readers_at_once_never_see_half_a_file(cache, caplog):
    results, path = [], cache / "kind" / "key.npz"

    def work():
        for _ in range(30):
            results.append(cached_arrays("kind", "key", Counting(50_000))["squares"][-1])
            path.unlink(missing_ok=True)

    threads = [threading.Thread(target=work) for _ in range(4)]
    with caplog.at_level(logging.WARNING, logger="vtgtsam"):
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert set(results) == {49_999**2} and len(results) == 120
    assert not caplog.records
    assert not list(cache.rglob("*.part"))


def test_folder_is_the_chosen_one_else_the_platforms(monkeypatch):
    monkeypatch.setenv("VTGTSAM_CACHE", "/somewhere/else")
    assert cache_directory() == Path("/somewhere/else")
    monkeypatch.delenv("VTGTSAM_CACHE")
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", "/xdg")
    assert cache_directory() == Path("/xdg/vtgtsam")
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", "/home/someone")
    assert cache_directory() == Path("/home/someone/.cache/vtgtsam")
