# SPDX-License-Identifier: MIT
"""The dataset as LeRobot's own package reads it: `make test-lerobot`; elsewhere it is not installed."""

import numpy as np
import pytest
from made_estimates import true_pose, write_estimates

from vtgtsam.evaluation.lerobot import export_lerobot

pytest.importorskip("lerobot", reason="lerobot is not installed: make test-lerobot")

TIMES = np.arange(0.0, 2.0, 0.1)


@pytest.fixture
def root(tmp_path, monkeypatch):
    monkeypatch.setenv("HF_HUB_OFFLINE", "1")
    write_estimates(tmp_path / "in", "a_0", "can", TIMES)
    write_estimates(tmp_path / "in", "b_0", "mug", TIMES[:12])
    export_lerobot(tmp_path / "in", tmp_path / "out")
    return tmp_path / "out"


def test_lerobot_reads_every_frame_back(root):
    import torch
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    dataset = LeRobotDataset("vtgtsam/estimates", root=root)
    assert (dataset.num_episodes, dataset.num_frames, dataset.fps) == (2, 32, 10)
    for n, time in enumerate([*TIMES, *TIMES[:12]]):
        item = dataset[n]
        pose = item["observation.environment_state"].numpy()
        expected = true_pose(time)
        np.testing.assert_allclose(pose[:3], expected[:3], atol=1e-6)
        assert abs(pose[3:] @ expected[3:]) > 1 - 1e-6
        assert item["timestamp"] == torch.tensor(time, dtype=torch.float32)
        assert item["task"] == ("hold the can" if n < 20 else "hold the mug")
        assert item["estimate.status"] == "ok"


def test_lerobot_cuts_windows_at_the_episodes_ends(root):
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    past = {"observation.contacts": [-0.1, 0.0]}
    item = LeRobotDataset("vtgtsam/estimates", root=root, delta_timestamps=past)[20]
    assert item["observation.contacts"].tolist() == [[1, 0, 0], [1, 0, 0]]  # not of the first
    assert item["observation.contacts_is_pad"].tolist() == [True, False]


def test_lerobot_batches_for_a_policy(root):
    import torch
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    dataset = LeRobotDataset("vtgtsam/estimates", root=root, episodes=[1])
    (batch,) = torch.utils.data.DataLoader(dataset, batch_size=12)
    assert batch["observation.environment_state"].shape == (12, 7)
    mean = dataset.meta.stats["observation.environment_state"]["mean"]
    assert mean.shape == (7,)
    assert mean[0] == pytest.approx(0.1, abs=1e-6)
