# SPDX-License-Identifier: MIT
"""`vtgtsam view`, checked by reading the .rrd file back with Rerun's own reader."""

import importlib
import sys

import gtsam
import numpy as np
import pandas as pd
import pytest
from held_box import HAND_XML, PADS, write_grasp

from vtgtsam import EstimatorConfig, PoseEstimator, cli, evaluate, read_recording
from vtgtsam.camera import CameraIntrinsics
from vtgtsam.exceptions import RecordingError, VtgtsamError
from vtgtsam.recording import RecordingWriter
from vtgtsam.recording.images import decode_depth

pytest.importorskip("rerun", reason="the viewer (extra viz) is not installed")

FRAMES = 8
METHODS = ("vis", "vis+pen", "vis+tac+pen")
START = np.timedelta64(1_000_000_000, "ns")  # the recording's first frame


def view(monkeypatch, capsys, *arguments):
    """Run the command in this process: exit code, stdout, stderr."""
    monkeypatch.setattr(sys, "argv", ["vtgtsam", "view", *map(str, arguments)])
    try:
        cli.main()
        code = 0
    except SystemExit as stopped:
        code = stopped.code or 0
    return code, *capsys.readouterr()


class Shown:
    """What a .rrd file holds, by entity and component."""

    def __init__(self, path):
        from rerun.chunk import RrdReader

        self.tables = {}
        for chunk in RrdReader(path).stream():
            table = chunk.to_record_batch().to_pandas()
            self.tables.setdefault(chunk.entity_path, []).append(table)

    def __getitem__(self, key):
        """Values of an entity's component over time, indexed by time."""
        entity, component = key
        found = [t for t in self.tables[entity] if component in t and "time" in t]
        table = pd.concat(found).set_index("time").sort_index()
        return table[component].dropna()

    def numbers(self, entity, component):
        return np.array([np.stack(list(entry)) for entry in self[entity, component]])[:, 0]


@pytest.fixture(scope="module")
def grasp(tmp_path_factory):
    folder = tmp_path_factory.mktemp("grasp")
    recording = write_grasp(folder / "in" / "set" / "box_0.mcap", frames=FRAMES)
    evaluate(folder / "in", METHODS, EstimatorConfig.tuned(), folder / "out")
    return recording, folder / "out"


@pytest.fixture(scope="module")
def shown(grasp, tmp_path_factory):
    recording, out = grasp
    path = tmp_path_factory.mktemp("view") / "box.rrd"
    arguments = ["view", str(recording), "--estimates", str(out), "--save", str(path)]
    with pytest.MonkeyPatch.context() as patch, pytest.raises(SystemExit) as stopped:
        patch.setattr(sys, "argv", ["vtgtsam", *arguments])
        cli.main()
    assert not stopped.value.code
    return Shown(path)


def test_the_object_stands_at_the_truth_and_at_each_methods_estimate(grasp, shown):
    recording, out = grasp
    truth = read_recording(recording).ground_truth
    at_truth = shown.numbers("/world/object/truth", "Transform3D:translation")
    np.testing.assert_allclose(at_truth, [T.translation() for T in truth.poses], atol=1e-6)
    stored = pd.read_parquet(out / "estimates" / "set__box_0.parquet")
    for method in METHODS:
        rows = stored[stored["method"] == method]
        path = "/world/object/" + method.replace("+", r"\+")
        t = shown.numbers(path, "Transform3D:translation")
        q = shown.numbers(path, "Transform3D:quaternion")
        np.testing.assert_allclose(t, rows[["x", "y", "z"]], atol=1e-6)  # stored as float32
        np.testing.assert_allclose(q, rows[["qx", "qy", "qz", "qw"]], atol=1e-6)


def test_each_estimate_has_the_ellipsoid_that_holds_its_centre_with_95_percent(grasp, shown):
    recording, out = read_recording(grasp[0]), grasp[1]
    stored = pd.read_parquet(out / "estimates" / "set__box_0.parquet")
    rows = stored[stored["method"] == "vis+tac+pen"]
    path = r"/world/uncertainty/vis\+tac\+pen"
    half = shown.numbers(path, "Ellipsoids3D:half_sizes")
    center = shown.numbers(path, "Ellipsoids3D:centers")
    T = gtsam.Pose3(
        gtsam.Rot3.Quaternion(*rows[["qw", "qx", "qy", "qz"]].iloc[-1]),
        rows[["x", "y", "z"]].iloc[-1],
    )
    np.testing.assert_allclose(center[-1], T.transformFrom(recording.object.center), atol=1e-6)
    # Of many poses that are drawn from the covariance 95 % have their centre inside.
    names = [name for name in rows if name.startswith("cov_")]
    covariance = np.zeros((6, 6))
    covariance[np.triu_indices(6)] = rows[names].iloc[-1]
    covariance += np.triu(covariance, 1).T
    quaternion = shown.numbers(path, "Ellipsoids3D:quaternions")[-1]
    axes = gtsam.Rot3.Quaternion(*np.roll(quaternion.astype(float), 1)).matrix()
    drawn = np.random.default_rng(0).multivariate_normal(np.zeros(6), covariance, 4000)
    centers = np.array([T.retract(xi).transformFrom(recording.object.center) for xi in drawn])
    inside = np.sum((((centers - center[-1]) @ axes) / half[-1]) ** 2, axis=1) < 1
    assert 0.93 < inside.mean() < 0.97


def test_the_truth_is_grey_and_methods_have_their_colours_of_the_report():
    from vtgtsam.evaluation.figures.style import looks
    from vtgtsam.viz.colors import Palette

    red, green, blue = Palette().of("truth")
    assert max(red, green, blue) - min(red, green, blue) < 20
    for method, look in looks([*METHODS, "vis+tac+pen+mem"]).items():
        assert "#{:02X}{:02X}{:02X}".format(*Palette().of(method)) == look.color


def test_errors_are_those_of_the_evaluation(grasp, shown):
    _, out = grasp
    metrics = pd.read_parquet(out / "metrics.parquet")
    for method in METHODS:
        adds_mm = 1e3 * metrics[metrics["method"] == method]["adds_m"]
        plotted = shown.numbers("/plots/adds_mm/" + method.replace("+", r"\+"), "Scalars:scalars")
        np.testing.assert_allclose(plotted, adds_mm, rtol=1e-9)


def test_pads_are_as_far_and_count_as_much_as_the_estimator_says(grasp, shown):
    recording = read_recording(grasp[0])
    config = EstimatorConfig.tuned(method="vis+tac+pen")  # the last that was evaluated
    estimator = PoseEstimator(recording.hand, recording.object, config)
    estimates = [estimator.update(frame) for frame in recording.measurements()]
    for k, pad in enumerate(PADS):
        plotted = shown.numbers(f"/plots/pad_distance_mm/{pad}", "Scalars:scalars")
        expected = [1e3 * estimate.pad_distances[k] for estimate in estimates]
        np.testing.assert_allclose(plotted, expected, atol=1e-6)
    from vtgtsam.viz.colors import of_pads

    colors = np.stack(list(shown["/world/hand/pads", "Boxes3D:colors"]))
    weights = np.array([estimate.pad_weights for estimate in estimates])
    touching = np.ones(len(PADS), dtype=bool)
    for shown_colors, row in zip(colors, weights, strict=True):
        rgba = np.frombuffer(shown_colors.astype(">u4").tobytes(), np.uint8).reshape(-1, 4)
        np.testing.assert_allclose(rgba[:, :3].astype(int), of_pads(touching, row), atol=1)


def test_the_hand_moves_with_its_recorded_pose_and_time_is_the_recordings(grasp, shown):
    frames = read_recording(grasp[0]).measurements()
    column = shown["/world/hand", "Transform3D:translation"]
    assert column.index[0] == START
    assert len(column) == len(frames)
    quaternions = shown.numbers("/world/hand", "Transform3D:quaternion")
    for quat_xyzw, frame in zip(quaternions, frames, strict=True):
        x, y, z, w = quat_xyzw.astype(float)
        assert gtsam.Rot3.Quaternion(w, x, y, z).equals(frame.T_wh.rotation(), 1e-6)


def test_a_status_is_written_when_it_changes(shown):
    entries = shown["/status/vis", "TextLog:text"]
    assert [entry[0] for entry in entries] == ["vis: ok"]


def test_colors_of_pads_tell_free_doubted_and_believed_apart():
    from vtgtsam.viz.colors import BELIEVED, DOUBTED, FREE, of_pads

    colors = of_pads(np.array([False, True, True, True]), np.array([1.0, 0.0, 0.5, 1.0]))
    np.testing.assert_array_equal(colors[0], FREE)
    np.testing.assert_array_equal(colors[1], DOUBTED)
    np.testing.assert_allclose(colors[2], (DOUBTED + BELIEVED) / 2, atol=0.51)
    np.testing.assert_array_equal(colors[3], BELIEVED)


def test_without_estimates_the_recordings_own_poses_are_shown(tmp_path, grasp, monkeypatch, capsys):
    path = tmp_path / "plain.rrd"
    code, out, err = view(monkeypatch, capsys, grasp[0], "--save", path)
    assert (code, err) == (0, "")
    assert f"rerun {path}" in out
    shown = Shown(path)
    frames = read_recording(grasp[0]).measurements()
    seen = shown.numbers(r"/world/object/visual\ tracker", "Transform3D:translation")
    np.testing.assert_allclose(seen, [f.T_wo_visual.translation() for f in frames], atol=1e-6)
    assert not any("vis+" in entity for entity in shown.tables)


def test_without_a_display_one_sentence_says_what_to_do(grasp, monkeypatch, capsys):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    code, out, err = view(monkeypatch, capsys, grasp[0])
    assert (code, out) == (1, "")
    assert err.count("\n") == 1
    assert "there is no display" in err and "--save" in err


@pytest.mark.parametrize("change", ["time", "contacts"])
def test_estimates_of_another_recording_are_refused(tmp_path, grasp, monkeypatch, capsys, change):
    path = tmp_path / "set" / "box_0.mcap"
    path.parent.mkdir()
    pads = np.ones(4)
    pads[0] = change != "contacts"
    with RecordingWriter(path, {"object": "can"}, hand_xml=HAND_XML) as writer:
        for k in range(FRAMES):
            t = 1.0 + (0.033 if change == "contacts" else 0.034) * k
            writer.joint_states(t, [f"j_{name}" for name in PADS], np.zeros(4))
            writer.tactile(t, PADS, np.zeros(4), pads)
            writer.object_pose(t, gtsam.Pose3())
    arguments = (path, "--estimates", grasp[1], "--save", tmp_path / "x.rrd")
    code, _, err = view(monkeypatch, capsys, *arguments)
    assert code == 1
    assert "belongs to another recording" in err


def test_a_folder_without_estimates_says_what_it_has(grasp, tmp_path):
    from vtgtsam.viz.tracks import find_estimates

    assert find_estimates(grasp[1], grasp[0]).name == "set__box_0.parquet"
    with pytest.raises(RecordingError, match="it has set__box_0"):
        find_estimates(grasp[1], tmp_path / "other.mcap")
    with pytest.raises(RecordingError, match="it has none at all"):
        find_estimates(tmp_path, tmp_path / "other.mcap")


def test_images_are_shown_at_their_own_instants_through_the_recorded_camera(
    tmp_path, monkeypatch, capsys
):
    path, camera = tmp_path / "images.mcap", CameraIntrinsics(6, 4, 5.0, 5.0, 2.5, 1.5)
    depths = [np.full((4, 6), 0.5 + 0.01 * k) for k in range(3)]
    with RecordingWriter(path, {"object": "can"}, hand_xml=HAND_XML) as writer:
        writer.camera_pose(0.0, gtsam.Pose3())
        writer.camera_info(0.0, camera)
        for k, depth in enumerate(depths):
            writer.joint_states(0.1 * k, [f"j_{name}" for name in PADS], np.zeros(4))
            writer.tactile(0.1 * k, PADS, np.zeros(4), np.zeros(4))
            writer.depth(0.1 * k + 0.05, depth)
            writer.color(0.1 * k + 0.05, np.full((4, 6, 3), 200, np.uint8))
    code, _, err = view(monkeypatch, capsys, path, "--save", tmp_path / "images.rrd")
    assert (code, err) == (0, "")
    shown = Shown(tmp_path / "images.rrd")
    blobs = shown["/world/camera/depth", "EncodedDepthImage:blob"]
    assert [t / np.timedelta64(1, "ms") for t in blobs.index] == [50, 150, 250]
    for blob, depth in zip(blobs, depths, strict=True):
        np.testing.assert_allclose(decode_depth(bytes(blob[0])), depth, atol=1e-6)
    assert len(shown["/world/camera/color", "EncodedImage:blob"]) == 3
    matrix = shown.numbers("/world/camera", "Pinhole:image_from_camera")[0]
    np.testing.assert_allclose(matrix.reshape(3, 3).T, camera.matrix)  # Rerun: column by column
    axes = shown.tables["/world"][0]["ViewCoordinates:xyz"][0][0]
    np.testing.assert_array_equal(axes, [3, 2, 5])  # right, down, forward: the camera is the world


def test_a_file_that_cannot_be_written_is_one_sentence(tmp_path, grasp, monkeypatch, capsys):
    for target, words in (("x.mcap", "called .rrd"), ("no/folder/x.rrd", "cannot write")):
        code, _, err = view(monkeypatch, capsys, grasp[0], "--save", tmp_path / target)
        assert code == 1 and err.count("\n") == 1
        assert words in err


def test_several_recordings_are_not_guessed_between(tmp_path, monkeypatch, capsys):
    for name in "ab":
        write_grasp(tmp_path / f"{name}.mcap", frames=2)
    code, _, err = view(monkeypatch, capsys, tmp_path, "--save", tmp_path / "x.rrd")
    assert code == 1
    assert "holds 2 recordings" in err and "a.mcap" in err


def test_without_rerun_a_sentence_says_what_to_install(monkeypatch):
    import vtgtsam.viz

    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(VtgtsamError, match=r"rerun: pip install .*\[viz\]'"):
        importlib.reload(vtgtsam.viz)
