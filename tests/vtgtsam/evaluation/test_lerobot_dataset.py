# SPDX-License-Identifier: MIT
import json

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from made_estimates import true_pose, write_estimates

from vtgtsam import VtgtsamError
from vtgtsam.evaluation.lerobot import dataset, export_lerobot
from vtgtsam.evaluation.lerobot.statistics import Statistics

TIMES = 5.0 + np.array([0.0, 0.101, 0.2, 0.299, 0.5, 2.0])  # [s], about 10 Hz, with gaps


@pytest.fixture
def results(tmp_path):
    write_estimates(tmp_path / "in", "a_0", "can", TIMES)
    write_estimates(tmp_path / "in", "b_0", "mug", TIMES[:4], silent=1)
    return tmp_path / "in"


def frames_of(root):
    table = pq.read_table(root / "data/chunk-000/file-000.parquet")
    return {name: np.array(table[name].to_pylist()) for name in table.column_names}


def test_frames_come_at_the_fixed_rate_with_the_last_estimate_before(results, tmp_path):
    written = export_lerobot(results, tmp_path / "out")
    assert (written.fps, written.method) == (10, "vis+tac+pen")
    frames = frames_of(tmp_path / "out")
    first = frames["episode_index"] == 0
    np.testing.assert_allclose(frames["timestamp"][first], np.arange(21) / 10, atol=1e-6)
    held_s = TIMES[[0, 0, 2, 3, 3] + [4] * 15 + [5]]
    poses = frames["observation.environment_state"][first]
    for pose, time in zip(poses, held_s, strict=True):
        expected = true_pose(time)
        sign = np.sign(expected[3:] @ pose[3:])
        np.testing.assert_allclose(pose[:3], expected[:3], atol=1e-6)
        np.testing.assert_allclose(sign * pose[3:], expected[3:], atol=1e-6)
    ages = 5.0 + np.arange(21) / 10 - held_s
    np.testing.assert_allclose(frames["estimate.age"][first], ages, atol=1e-6)
    np.testing.assert_array_equal(frames["observation.contacts"][1], [1, 0, 0])
    np.testing.assert_allclose(frames["estimate.sigma"][0], [0.01, 0.02, np.inf, 1e-3, 2e-3, 3e-3])
    assert set(frames["estimate.status"]) == {"ok"}


def test_neighbouring_quaternions_have_one_sign(tmp_path):
    write_estimates(tmp_path / "in", "a_0", "can", np.arange(0.0, 5.0, 0.1))  # more than two turns
    export_lerobot(tmp_path / "in", tmp_path / "out")
    quaternions = frames_of(tmp_path / "out")["observation.environment_state"][:, 3:]
    assert (np.sum(quaternions[1:] * quaternions[:-1], axis=1) > 0.9).all()


def test_an_episode_begins_with_the_first_pose(results, tmp_path):
    export_lerobot(results, tmp_path / "out")
    frames = frames_of(tmp_path / "out")
    second = frames["episode_index"] == 1
    pose = frames["observation.environment_state"][second][0]
    np.testing.assert_allclose(pose[2], 0.01 * TIMES[1], atol=1e-6)
    assert frames["frame_index"][second].tolist() == [0, 1]
    assert frames["index"].tolist() == list(range(23))


def test_the_episodes_say_where_their_frames_are_and_from_which_sequence(results, tmp_path):
    export_lerobot(results, tmp_path / "out", task="pick up the {object}")
    table = pq.read_table(tmp_path / "out/meta/episodes/chunk-000/file-000.parquet").to_pylist()
    assert [row["sequence"] for row in table] == ["a_0", "b_0"]
    spans = [(row["dataset_from_index"], row["dataset_to_index"], row["length"]) for row in table]
    assert spans == [(0, 21, 21), (21, 23, 2)]
    assert [row["tasks"] for row in table] == [["pick up the can"], ["pick up the mug"]]
    tasks = pd.read_parquet(tmp_path / "out/meta/tasks.parquet")  # the words are the index
    assert tasks.loc["pick up the mug", "task_index"] == 1


def test_info_and_statistics_are_json_without_infinities(results, tmp_path):
    export_lerobot(results, tmp_path / "out", method="vis", fps=5)
    info = json.loads((tmp_path / "out/meta/info.json").read_text(), parse_constant=pytest.fail)
    stats = json.loads((tmp_path / "out/meta/stats.json").read_text(), parse_constant=pytest.fail)
    assert (info["codebase_version"], info["fps"], info["total_episodes"]) == ("v3.0", 5, 2)
    assert info["features"]["observation.contacts"]["names"] == ["pad_0", "pad_1", "pad_2"]
    frames = frames_of(tmp_path / "out")
    heights = frames["observation.environment_state"][:, 2]
    np.testing.assert_allclose(heights[0], 0.01 * 5.0 + 1e-3, atol=1e-6)
    found = stats["observation.environment_state"]
    np.testing.assert_allclose(found["mean"][2], heights.mean(), atol=1e-9)
    np.testing.assert_allclose(found["std"][2], heights.std(), atol=1e-9)
    assert (found["min"][2], found["max"][2]) == (heights.min(), heights.max())
    assert found["count"] == [len(heights)]
    assert stats["estimate.sigma"]["max"][2] == 0.0  # never finite
    assert "estimate.status" not in stats


def test_a_full_file_is_followed_by_another(results, tmp_path, monkeypatch):
    monkeypatch.setattr(dataset, "FILE_MB", 0)
    monkeypatch.setattr(dataset, "FILES_IN_CHUNK", 1)
    export_lerobot(results, tmp_path / "out")
    episodes = pq.read_table(tmp_path / "out/meta/episodes/chunk-000/file-000.parquet").to_pylist()
    places = [(row["data/chunk_index"], row["data/file_index"]) for row in episodes]
    assert places == [(0, 0), (1, 0)]
    second = pq.read_table(tmp_path / "out/data/chunk-001/file-000.parquet")
    assert second["episode_index"].to_pylist() == [1, 1]


def test_statistics_of_parts_add_up():
    values = np.random.default_rng(0).normal(size=(50, 3))
    values[7, 1] = np.inf
    parts = Statistics.of(values[:20]) + Statistics.of(values[20:])
    for key, value in Statistics.of(values).as_lerobot().items():
        np.testing.assert_allclose(parts.as_lerobot()[key], value, rtol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(method="vis+pen"), "no estimates by 'vis[+]pen'; there are vis, vis[+]tac[+]pen"),
        (dict(results="nowhere"), "nowhere holds no estimates; give a folder that"),
        (dict(out="in"), "in is there already; give another folder"),
    ],
)
def test_what_cannot_be_exported_is_said(results, tmp_path, change, message):
    change = {"method": None} | change
    with pytest.raises(VtgtsamError, match=message):
        export_lerobot(
            tmp_path / change.get("results", "in"),
            tmp_path / change.get("out", "out"),
            change["method"],
        )
    assert not (tmp_path / "out").exists()


def test_hands_with_other_pads_are_named_and_nothing_is_left(results, tmp_path):
    write_estimates(results, "c_0", "can", TIMES, pads=2)
    with pytest.raises(VtgtsamError, match="a_0 and c_0 are of hands with other pads"):
        export_lerobot(results, tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["in"]
