# SPDX-License-Identifier: MIT
import dataclasses
import hashlib
import logging
from pathlib import Path

import gtsam
import numpy as np
import pandas as pd
import pytest
import yaml
from held_box import turned, write_grasp

from vtgtsam import EstimatorConfig, PoseEstimator, adds, evaluate, read_recording
from vtgtsam.evaluation.estimates import poses
from vtgtsam.evaluation.sequence import evaluate_sequence
from vtgtsam.exceptions import ConfigError

METHODS = ("vis", "vis+pen", "vis+tac+pen")


def tree(folder: Path) -> dict[str, str]:
    """Hash of each file by its path in the folder."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


@pytest.fixture(scope="module")
def grasps(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("grasps")
    for seed in range(3):
        write_grasp(folder / "day" / f"{seed}.mcap", seed=seed)
    return folder


@pytest.fixture(scope="module")
def out(grasps, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("out")
    evaluate(grasps, METHODS, "tuned", folder)
    return folder


def evaluated(monkeypatch) -> list[str]:
    """Sequences that get computed from now on, rather than found."""
    import vtgtsam.evaluation.run as run

    computed = []

    def watched(task):
        outcome = evaluate_sequence(task)
        if not outcome.reused:
            computed.append(task.sequence)
        return outcome

    monkeypatch.setattr(run, "evaluate_sequence", watched)
    return computed


def test_it_writes_what_it_promises(out):
    names = set(tree(out))
    sequences = [f"day__{seed}" for seed in range(3)]
    assert names == {
        ".vtgtsam/files.json",
        ".vtgtsam/lock",
        *(f".vtgtsam/parts/{name}.json" for name in sequences),
        "metrics.parquet",
        "per_sequence.csv",
        "summary.csv",
        "over_time.csv",
        "tests.csv",
        "tests_time.csv",
        "tests_noise.csv",
        "sequences.csv",
        "config.yaml",
        "bop/scenes.csv",
        *(f"bop/{method}.csv" for method in METHODS),
        *(f"tum/{method}/{name}.txt" for method in METHODS for name in sequences),
        *(f"{folder}/{name}.parquet" for folder in ("estimates", "metrics") for name in sequences),
    }


def test_estimates_are_the_estimators(grasps, out):
    recording = read_recording(grasps / "day" / "1.mcap")
    table = pd.read_parquet(out / "estimates" / "day__1.parquet")
    for method in METHODS:
        estimator = PoseEstimator(
            recording.hand, recording.object, EstimatorConfig.tuned(method=method)
        )
        rows = table[table["method"] == method].to_dict("records")
        for row, measurement in zip(rows, recording.measurements(), strict=True):
            estimate = estimator.update(measurement)
            quat = gtsam.Rot3.Quaternion(row["qw"], row["qx"], row["qy"], row["qz"])
            T_wo = gtsam.Pose3(quat, np.array([row["x"], row["y"], row["z"]]))
            assert T_wo.equals(estimate.T_wo, 1e-12)
            assert row["time"] == measurement.time
            assert row["status"] == estimate.status
            assert row["visual_weight"] == estimate.visual_weight
            assert row["cov_rx_rx"] == estimate.covariance[0, 0]
            assert row["cov_rz_ty"] == estimate.covariance[2, 4]
            assert row["cov_tz_tz"] == estimate.covariance[5, 5]
            assert list(row["contacts"]) == [True] * 4


def test_the_visual_method_is_the_visual_pose_as_it_is(grasps, out):
    recording = read_recording(grasps / "day" / "0.mcap")
    table = pd.read_parquet(out / "estimates" / "day__0.parquet")
    seen = np.array([T.translation() for T in recording.visual_poses.poses])
    vis = table[table["method"] == "vis"]
    np.testing.assert_allclose(vis[["x", "y", "z"]], seen, atol=1e-12)
    np.testing.assert_allclose(vis["time_rel"], 0.033 * np.arange(20), atol=1e-6)


def test_metrics_follow_from_estimates_and_truth(grasps, out):
    recording = read_recording(grasps / "day" / "2.mcap")
    estimates = pd.read_parquet(out / "estimates" / "day__2.parquet")
    metrics = pd.read_parquet(out / "metrics.parquet").query("sequence == 'day__2'")
    assert len(estimates) == len(metrics)
    for i in (0, 25, 59):
        row, found = estimates.iloc[i], metrics.iloc[i]
        quat = gtsam.Rot3.Quaternion(row["qw"], row["qx"], row["qy"], row["qz"])
        T_est = gtsam.Pose3(quat, np.array([row["x"], row["y"], row["z"]]))
        (T_true,) = recording.truth_at([row["time"]])
        for name in ("method", "time", "time_rel", "status"):
            assert found[name] == row[name]
        assert found["adds_m"] == pytest.approx(
            adds(recording.object.mesh, T_est, T_true), abs=1e-9
        )
        # the box's centre is its origin
        expected = np.linalg.norm(T_est.translation() - T_true.translation())
        assert found["translation_m"] == pytest.approx(expected, abs=1e-9)
        R = T_true.rotation().matrix().T @ T_est.rotation().matrix()
        angle = np.arccos((np.trace(R) - 1) / 2)
        assert found["rotation_rad"] == pytest.approx(angle, abs=1e-6)


def test_fusion_is_better_than_vision_on_a_box_that_all_pads_touch(out):
    summary = pd.read_csv(out / "summary.csv").query("object == 'all' and phase == 'after'")
    median = summary.set_index("method")["adds_median_mm"]
    assert median["vis+tac+pen"] < 0.7 * median["vis"]


def test_the_answer_is_the_summary(grasps, out):
    summary = evaluate(grasps, METHODS, "tuned", out)
    stored = pd.read_csv(out / "summary.csv", keep_default_na=False)
    assert list(summary.columns) == list(stored.columns)
    np.testing.assert_allclose(summary["adds_median_mm"], stored["adds_median_mm"])
    assert summary.attrs["failed"] == {}


def test_two_processes_write_the_same_bytes_as_one(grasps, out, tmp_path):
    evaluate(grasps, METHODS, "tuned", tmp_path, jobs=2)
    assert tree(tmp_path) == tree(out)


def test_a_second_call_computes_nothing_and_changes_nothing(grasps, out, monkeypatch):
    before, computed = tree(out), evaluated(monkeypatch)
    evaluate(grasps, METHODS, "tuned", out)
    assert computed == []
    assert tree(out) == before


@pytest.mark.parametrize("missing", ["metrics", "estimates"])
def test_only_what_is_missing_is_computed_again(grasps, out, monkeypatch, missing):
    before, computed = tree(out), evaluated(monkeypatch)
    (out / missing / "day__1.parquet").unlink()
    evaluate(grasps, METHODS, "tuned", out)
    assert computed == ["day__1"]
    assert tree(out) == before


def test_a_damaged_part_and_leftovers_of_a_killed_run_are_replaced(grasps, out, monkeypatch):
    before, computed = tree(out), evaluated(monkeypatch)
    part = out / "estimates" / "day__2.parquet"
    part.write_bytes(part.read_bytes()[:100])
    (out / "estimates" / ".day__2.parquet.123.tmp").write_bytes(b"half")
    evaluate(grasps, METHODS, "tuned", out)
    assert computed == ["day__2"]
    assert tree(out) == before


def test_a_changed_recording_is_noticed(tmp_path, monkeypatch):
    for seed in range(2):
        write_grasp(tmp_path / "in" / f"{seed}.mcap", seed=seed, frames=6)
    evaluate(tmp_path / "in", ["vis"], "tuned", tmp_path / "out")
    computed = evaluated(monkeypatch)
    write_grasp(tmp_path / "in" / "1.mcap", seed=7, frames=6)
    evaluate(tmp_path / "in", ["vis"], "tuned", tmp_path / "out")
    assert computed == ["1"]
    evaluate(tmp_path / "in", ["vis"], "tuned", tmp_path / "fresh")
    assert tree(tmp_path / "out") == tree(tmp_path / "fresh")


def test_a_changed_setting_method_or_hand_is_noticed(tmp_path, monkeypatch):
    from held_box import HAND_XML

    recording, out = write_grasp(tmp_path / "0.mcap", frames=4), tmp_path / "out"
    hand = tmp_path / "hand.xml"
    hand.write_text(HAND_XML)
    computed = evaluated(monkeypatch)
    for config, methods, options in (
        (EstimatorConfig.tuned(), ["vis", "vis+pen"], {}),
        (EstimatorConfig.tuned(w_pen=11.0), ["vis", "vis+pen"], {}),
        (EstimatorConfig.tuned(w_pen=11.0), ["vis+pen"], {}),
        (EstimatorConfig.tuned(w_pen=11.0), ["vis+pen"], {"hand": hand}),
    ):
        evaluate(recording, methods, config, out, **options)
        evaluate(recording, methods, config, out, **options)
    assert computed == ["0"] * 4
    hand.write_text(HAND_XML.replace("0.012", "0.011"))
    evaluate(recording, ["vis+pen"], EstimatorConfig.tuned(w_pen=11.0), out, hand=hand)
    assert computed == ["0"] * 5
    assert list((out / "tum").iterdir()) == [out / "tum" / "vis+pen"]


def test_what_was_evaluated_before_and_is_not_asked_for_now_is_removed(tmp_path):
    for seed in range(2):
        write_grasp(tmp_path / "in" / f"{seed}.mcap", seed=seed, frames=4)
    evaluate(tmp_path / "in", ["vis"], "tuned", tmp_path / "out")
    evaluate(tmp_path / "in" / "0.mcap", ["vis"], "tuned", tmp_path / "out")
    evaluate(tmp_path / "in" / "0.mcap", ["vis"], "tuned", tmp_path / "fresh")
    assert tree(tmp_path / "out") == tree(tmp_path / "fresh")


def test_a_sequence_that_fails_is_listed_and_the_rest_is_kept(tmp_path, caplog):
    write_grasp(tmp_path / "in" / "good.mcap", frames=4)
    (tmp_path / "in" / "broken.mcap").write_bytes(b"this is no recording")
    summary = evaluate(tmp_path / "in", ["vis"], "tuned", tmp_path / "out")
    assert list(summary.attrs["failed"]) == ["broken"]
    assert "is not a recording" in summary.attrs["failed"]["broken"]
    assert "broken failed" in caplog.text
    sequences = pd.read_csv(tmp_path / "out" / "sequences.csv", keep_default_na=False)
    assert sequences["sequence"].tolist() == ["broken", "good"]
    assert (sequences["problem"] != "").tolist() == [True, False]
    assert set(summary["sequences"]) == {1}


def test_a_sequence_that_fails_now_leaves_no_old_results(tmp_path):
    recording = write_grasp(tmp_path / "in" / "0.mcap", frames=4)
    write_grasp(tmp_path / "in" / "1.mcap", frames=4)
    evaluate(tmp_path / "in", ["vis"], "tuned", tmp_path / "out")
    recording.write_bytes(b"gone")
    evaluate(tmp_path / "in", ["vis"], "tuned", tmp_path / "out")
    evaluate(tmp_path / "in", ["vis"], "tuned", tmp_path / "fresh")
    assert tree(tmp_path / "out") == tree(tmp_path / "fresh")


def test_a_mistake_in_the_program_is_one_failed_sequence_with_its_traceback_logged(
    tmp_path, monkeypatch, caplog
):
    import vtgtsam.evaluation.sequence as sequence

    write_grasp(tmp_path / "0.mcap", frames=4)
    monkeypatch.setattr(sequence, "phases_of", lambda frames: frames[0] / 0)
    summary = evaluate(tmp_path / "0.mcap", ["vis"], "tuned", tmp_path / "out")
    assert summary.attrs["failed"]["0"].startswith("TypeError")
    assert "Traceback" in caplog.text


def test_without_ground_truth_it_is_estimated_but_has_no_metrics(tmp_path):
    write_grasp(tmp_path / "0.mcap", frames=4, truth=False)
    summary = evaluate(tmp_path / "0.mcap", METHODS, "tuned", tmp_path / "out")
    assert summary.empty
    assert len(pd.read_parquet(tmp_path / "out" / "estimates" / "0.parquet")) == 12
    assert len(pd.read_parquet(tmp_path / "out" / "metrics.parquet")) == 0
    sequences = pd.read_csv(tmp_path / "out" / "sequences.csv", keep_default_na=False)
    assert "no ground truth" in sequences["note"][0]
    assert summary.attrs["failed"] == {}


def test_while_the_tracker_is_silent_the_last_visual_pose_moves_with_the_hand(tmp_path):
    write_grasp(tmp_path / "0.mcap", frames=60, silent=(30, 45))
    summary = evaluate(tmp_path / "0.mcap", METHODS, "tuned", tmp_path / "out")
    table = pd.read_parquet(tmp_path / "out" / "estimates" / "0.parquet")
    assert table.groupby("method")["time"].apply(len).tolist() == [60] * 3
    vis = table[table["method"] == "vis"].reset_index(drop=True)
    assert (vis["status"][30:45] == "lost").all()
    T_wo = poses(vis.to_dict("records"))
    T_ho = [turned(np.clip(k / 20 - 1, 0, 1)).between(T) for k, T in enumerate(T_wo)]
    assert all(T_ho[k].equals(T_ho[29], 1e-6) for k in range(30, 45))
    assert not T_wo[40].equals(T_wo[29], 0.01)
    lost = summary.query("object == 'all' and phase == 'all' and method == 'vis'")
    assert lost["frames_not_held"].tolist() == [15]


def test_a_tracker_silent_until_the_end_is_evaluated_until_the_end(tmp_path):
    write_grasp(tmp_path / "0.mcap", frames=40, silent=(20, 40))
    evaluate(tmp_path / "0.mcap", ["vis"], "tuned", tmp_path / "out")
    table = pd.read_parquet(tmp_path / "out" / "estimates" / "0.parquet")
    assert len(table) == 40
    assert table["time_rel"].iloc[-1] == pytest.approx(39 * 0.033, abs=1e-6)


def test_without_a_camera_pose_bop_is_left_out_with_a_word(tmp_path, caplog):
    write_grasp(tmp_path / "0.mcap", frames=4, camera=False)
    evaluate(tmp_path / "0.mcap", ["vis"], "tuned", tmp_path / "out")
    assert not (tmp_path / "out" / "bop").exists()
    assert "no camera pose" in caplog.text


def test_the_effective_configuration_is_stored(out):
    config = yaml.safe_load((out / "config.yaml").read_text())
    assert list(config["methods"]) == list(METHODS)
    assert config["methods"]["vis+pen"]["method"] == "vis+pen"
    assert config["methods"]["vis+pen"]["w_pen"] == EstimatorConfig.tuned().w_pen


def test_a_model_in_memory_replaces_the_recordings_object(tmp_path):
    recording = write_grasp(tmp_path / "0.mcap", frames=4)
    obj = dataclasses.replace(read_recording(recording).object, name="my_box")
    summary = evaluate(recording, ["vis"], "tuned", tmp_path / "out", object=obj, jobs=2)
    assert set(summary["object"]) == {"all", "my_box"}


def test_wrong_methods_configurations_and_jobs_are_refused(grasps, tmp_path):
    with pytest.raises(ValueError, match=r"unknown methods: vision; the known ones are: vis, "):
        evaluate(grasps, ["vis", "vision"], "tuned", tmp_path)
    with pytest.raises(ValueError, match="different names"):
        evaluate(grasps, ["vis", "vis"], "tuned", tmp_path)
    with pytest.raises(ValueError, match="a list of names, got the text 'vis'"):
        evaluate(grasps, "vis", "tuned", tmp_path)
    with pytest.raises(ConfigError, match="config must be an EstimatorConfig, a preset .* got int"):
        evaluate(grasps, ["vis"], 3, tmp_path)
    with pytest.raises(ConfigError, match="'best' is neither a preset"):
        evaluate(grasps, ["vis"], "best", tmp_path)
    with pytest.raises(ValueError, match="jobs must be at least 1"):
        evaluate(grasps, ["vis"], "tuned", tmp_path, jobs=0)


def test_progress_is_logged_not_printed(grasps, out, capsys, caplog):
    with caplog.at_level(logging.INFO):
        evaluate(grasps, METHODS, "tuned", out)
    assert capsys.readouterr().out == ""
