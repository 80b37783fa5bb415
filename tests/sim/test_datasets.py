# SPDX-License-Identifier: MIT
import csv
import dataclasses
import json
from collections import Counter

import gtsam
import numpy as np
import pytest
from graphics_needed import needs_graphics
from short_course import FRAMES, SAMPLES, shorten

import sim.record
from sim import sequence
from sim.datasets import DatasetError, generate, generate_alike
from sim.sampling import NotGraspable
from sim.sequence import SequenceName, Settings, make_sequence
from vtgtsam.exceptions import MeshError
from vtgtsam.recording import read_recording
from vtgtsam.recording.camera import camera_intrinsics, depth_images
from vtgtsam.vision import hand_back
from vtgtsam.vision.tracker import TrackedPose

BOX = SequenceName("gelatin_box", 0)


@pytest.fixture(autouse=True)
def short(monkeypatch):
    shorten(monkeypatch)
    sequence._world.cache_clear()


def make(path, name=BOX, scales=(1.0,), **settings):
    files = {scale: path.with_suffix(f".{scale:g}.mcap") for scale in scales}
    make_sequence(Settings(**{"dataset": "vary", **settings}), name, files)
    return [file.read_bytes() for file in files.values()]


def test_a_sequence_made_again_alone_has_the_same_bytes(tmp_path):
    (first,) = make(tmp_path / "a")
    make(tmp_path / "b", SequenceName("gelatin_box", 1))
    make(tmp_path / "b", SequenceName("can", 0))
    (again,) = make(tmp_path / "c")
    assert again == first


def test_another_seed_grasp_or_noise_gives_another_sequence(tmp_path):
    (first,) = make(tmp_path / "a")
    assert make(tmp_path / "b", seed=1) != [first]
    assert make(tmp_path / "c", SequenceName("gelatin_box", 1)) != [first]
    assert make(tmp_path / "d", scales=(2.0,)) != [first]


def test_noise_scales_see_the_same_grasp_and_each_is_as_if_made_alone(tmp_path):
    one, three = make(tmp_path / "both", scales=(1.0, 3.0))
    assert [three] == make(tmp_path / "alone", scales=(3.0,))
    mild = read_recording(tmp_path / "both.1.mcap")
    strong = read_recording(tmp_path / "both.3.mcap")
    assert (mild.info["noise_scale"], strong.info["noise_scale"]) == ("1", "3")
    for a, b in zip(mild.ground_truth.poses, strong.ground_truth.poses, strict=True):
        assert a.equals(b, 0.0)
    assert not mild.visual_poses.poses[-1].equals(strong.visual_poses.poses[-1], 1e-6)


def test_a_stereo_camera_measures_each_noise_anew(tmp_path):
    one, three = make(tmp_path / "both", scales=(1.0, 3.0), camera="stereo")
    assert one != three
    assert [three] == make(tmp_path / "alone", scales=(3.0,), camera="stereo")


class SeesInfrared:
    """A tracker that keeps what it was shown."""

    def __init__(self):
        self.shown = []

    def start(self, T_wo):
        pass

    def update(self, depth, T_wc, joints=None, T_wh=None, infrared=None):
        self.shown.append((depth, infrared))
        return TrackedPose.lost()


def test_a_stereo_cameras_left_image_goes_to_the_tracker_and_the_recording_says_so(
    tmp_path, monkeypatch
):
    tracker = SeesInfrared()
    monkeypatch.setattr(sim.record, "make_tracker", lambda *args: tracker)
    make(tmp_path / "a", camera="stereo", tracker="depth-hand")
    assert read_recording(tmp_path / "a.1.mcap").info["infrared"] == "yes"
    assert len(tracker.shown) == FRAMES
    for depth, infrared in tracker.shown:
        assert infrared.dtype == np.uint8 and infrared.shape == depth.shape
    depth, infrared = tracker.shown[0]
    # Pixel by pixel: the table is lit from above, the hand's sides are darker.
    table, near = depth > 1.0, (depth > 0.0) & (depth < 1.0)
    assert np.median(infrared[table]) > np.median(infrared[near]) + 3.0
    assert np.median(np.roll(infrared, 25, axis=1)[near]) > np.median(infrared[near]) + 1.0
    make(tmp_path / "b", tracker="depth-hand")
    assert tracker.shown[-1][1] is None
    assert "infrared" not in read_recording(tmp_path / "b.1.mcap").info


def test_a_sequence_has_all_streams_at_their_rates_and_says_how_it_was_made(tmp_path):
    make(tmp_path / "a", seed=7)
    recording = read_recording(tmp_path / "a.1.mcap")
    expected = {
        "dataset": "vary",
        "sequence": "gelatin_box_0",
        "seed": "7",
        "noise_scale": "1",
        "tracker": "depth",
        "hand": "isyhand",
        "object": "gelatin_box",
        "calibration_error": "no",
    }
    assert expected.items() <= recording.info.items()
    np.testing.assert_allclose(recording.ground_truth.times, np.arange(SAMPLES) / 100, atol=1e-9)
    frames = recording.measurements()
    assert set(recording.visual_poses.times.round(9)) <= set((np.arange(FRAMES) * 0.033).round(9))
    assert len(frames) == len(recording.visual_poses) > FRAMES / 2
    assert recording.warnings == []
    assert recording.object.name == "gelatin_box"
    # At rest on the palm a perfect start must stay a good pose.
    start = recording.truth_at([0.0])[0].between(frames[0].T_wo_visual)
    assert np.linalg.norm(start.translation()) < 0.005


class Spy:
    """A tracker that loses the object now and then, and remembers what it was told."""

    def __init__(self):
        self.starts, self.updates = [], []

    def start(self, T_wo):
        self.starts.append(T_wo)
        self.updates.clear()

    def update(self, depth, T_wc, joints=None, T_wh=None):
        self.updates.append((depth.copy(), T_wc, joints, T_wh))
        if len(self.updates) % 5 == 0:
            return TrackedPose.lost()
        return TrackedPose(gtsam.Pose3(), np.eye(6), 1.0, "ok")


@pytest.fixture
def spy(monkeypatch):
    tracker = Spy()
    monkeypatch.setattr(sim.record, "make_tracker", lambda *args: tracker)
    return tracker


def test_the_tracker_is_told_the_truth_once_and_a_frame_it_lost_has_no_pose(tmp_path, spy):
    make(tmp_path / "a")
    recording = read_recording(tmp_path / "a.1.mcap")
    (start,) = spy.starts
    assert start.equals(recording.truth_at([0.0])[0], 1e-9)
    assert len(spy.updates) == FRAMES
    lost = [4, 9]
    kept = [k for k in range(FRAMES) if k not in lost]
    np.testing.assert_allclose(recording.visual_poses.times, 0.033 * np.array(kept), atol=1e-9)


class ToldSpy(Spy):
    """The same, which can be told where to look; what it is told changes nothing."""

    def __init__(self):
        super().__init__()
        self.told = []

    def search_at(self, T_wo):
        self.told.append((len(self.updates), T_wo))


def test_a_tracker_with_back_is_told_the_fused_pose_where_it_lost_the_object(tmp_path, monkeypatch):
    tracker = ToldSpy()
    asked = []
    monkeypatch.setattr(sim.record, "make_tracker", lambda form, *_: asked.append(form) or tracker)
    monkeypatch.setattr(hand_back, "KNOWN", 1.0)
    monkeypatch.setattr(hand_back, "KNOWN_ANGLE", 10.0)
    make(tmp_path / "a", tracker="depth-hand+back")
    make(tmp_path / "b", tracker="depth-hand")
    with_back, without = (read_recording(tmp_path / f"{name}.1.mcap") for name in "ab")
    assert asked == ["depth-hand", "depth-hand"]
    assert (
        with_back.info["tracker"] == "depth-hand+back" and without.info["tracker"] == "depth-hand"
    )
    frames = {count for count, _ in tracker.told}
    assert {5, 10} <= frames and not {1, 2, 3, 4} & frames  # those it lost, not those it saw
    assert all(np.isfinite(T_wo.matrix()).all() for _, T_wo in tracker.told)


@needs_graphics
def test_stored_images_are_those_the_tracker_saw(tmp_path, spy):
    make(tmp_path / "a", images=True)
    camera = camera_intrinsics(tmp_path / "a.1.mcap")
    stored = list(depth_images(tmp_path / "a.1.mcap"))
    assert len(stored) == len(spy.updates) == FRAMES
    for (_, image), (seen, *_) in zip(stored, spy.updates, strict=True):
        assert image.shape == (camera.height, camera.width)
        np.testing.assert_allclose(image, seen, atol=0.00051)  # whole millimetres
    assert 0.05 < (stored[0][1] > 0).mean() < 0.9


@needs_graphics
def test_images_are_left_out_unless_asked_for_and_change_nothing_else(tmp_path):
    make(tmp_path / "a")
    make(tmp_path / "b", images=True)
    without, with_images = (read_recording(tmp_path / f"{n}.1.mcap") for n in "ab")
    assert list(depth_images(tmp_path / "a.1.mcap")) == []
    for a, b in zip(without.visual_poses.poses, with_images.visual_poses.poses, strict=True):
        assert a.equals(b, 0.0)


def test_calibration_errors_are_believed_by_everyone_but_the_truth(tmp_path, spy):
    make(tmp_path / "a")
    make(tmp_path / "b", calibration_error=True)
    good, bad = (read_recording(tmp_path / f"{n}.1.mcap") for n in "ab")
    assert bad.info["calibration_error"] == "yes"
    for a, b in zip(good.ground_truth.poses, bad.ground_truth.poses, strict=True):
        assert a.equals(b, 0.0)
    error = bad.camera_pose * good.camera_pose.inverse()
    assert np.linalg.norm(error.translation()) == pytest.approx(0.002)
    offsets = bad.measurements()[3].joints - good.measurements()[3].joints
    assert 0.005 < np.sqrt((offsets**2).mean()) < 0.04  # 1 degree is 0.017 rad
    # What the camera sees of the object's place is right; what follows from it in the world is not.
    assert spy.starts[1].equals(error * spy.starts[0], 1e-9)


def run(tmp_path, objects=("gelatin_box",), grasps=2, scales=(1.0,), told=None, **settings):
    settings = Settings(**{"dataset": "vary", **settings})
    told = [] if told is None else told
    progress = lambda *event: told.append(event)  # noqa: E731
    return generate(settings, objects, grasps, scales, tmp_path, 1, progress)


def test_a_dataset_lies_where_it_should(tmp_path, spy):
    told = []
    outcomes = run(tmp_path, told=told)
    folder = tmp_path / "vary"
    assert sorted(p.name for p in folder.glob("*.mcap")) == [
        "gelatin_box_0.mcap",
        "gelatin_box_1.mcap",
    ]
    assert [str(outcome.name) for outcome in outcomes] == ["gelatin_box_0", "gelatin_box_1"]
    assert told == [
        ("objects", 1, 1, "gelatin_box: ready"),
        ("sequences", 1, 2, str(outcomes[0])),
        ("sequences", 2, 2, str(outcomes[1])),
    ]
    assert str(outcomes[0]).startswith("gelatin_box_0: done")
    assert json.loads((folder / "dataset.json").read_text())["seed"] == 0
    assert not list(folder.rglob("*.tmp"))


def test_several_noise_scales_have_a_folder_each(tmp_path, spy):
    run(tmp_path, grasps=1, scales=(0.5, 2.0))
    found = sorted(str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*.mcap"))
    assert found == ["vary/noise_0.5/gelatin_box_0.mcap", "vary/noise_2/gelatin_box_0.mcap"]


def test_what_is_there_is_kept_and_what_is_missing_is_made(tmp_path, spy):
    run(tmp_path)
    folder = tmp_path / "vary"
    kept, gone = folder / "gelatin_box_0.mcap", folder / "gelatin_box_1.mcap"
    content, age = gone.read_bytes(), kept.stat().st_mtime_ns
    gone.unlink()
    outcomes = run(tmp_path)
    assert [outcome.reused for outcome in outcomes] == [True, False]
    assert kept.stat().st_mtime_ns == age
    assert gone.read_bytes() == content


def test_more_grasps_or_objects_may_be_asked_for_later(tmp_path, spy):
    run(tmp_path, grasps=1)
    outcomes = run(tmp_path, objects=("can", "gelatin_box"), grasps=1)
    assert [outcome.reused for outcome in outcomes] == [False, True]


def test_runs_in_which_the_same_happens_are_simulated_once_and_each_is_as_if_made_alone(
    tmp_path, monkeypatch
):
    paper = Settings("vary")
    stereo = Settings("vary", camera="stereo", tracker="depth-hand")
    variants = {
        "paper": paper,
        "stereo": stereo,
        "paper-robot": dataclasses.replace(paper, robot=3),
        "stereo-robot": dataclasses.replace(stereo, registration_error=True),
    }
    alone = {}
    for name, settings in variants.items():
        generate(settings, ["gelatin_box"], 1, [1.0], tmp_path / "alone" / name)
        alone[name] = (tmp_path / "alone" / name / "vary/gelatin_box_0.mcap").read_bytes()
    assert len(set(alone.values())) == len(variants)
    calls = []
    for name in ("film", "sample_sequence"):
        once = getattr(sequence, name)
        monkeypatch.setattr(
            sequence, name, lambda *args, n=name, f=once: calls.append(n) or f(*args)
        )
    runs = {tmp_path / name: settings for name, settings in variants.items()}
    outcomes = generate_alike(runs, ["gelatin_box"], 1, [1.0])
    assert sorted(calls) == ["film", "film", "sample_sequence"]
    made = {out.name: out / "vary/gelatin_box_0.mcap" for out in runs}
    assert {name: path.read_bytes() for name, path in made.items()} == alone
    made["stereo"].unlink()
    again = generate_alike(runs, ["gelatin_box"], 1, [1.0])
    assert made["stereo"].read_bytes() == alone["stereo"]
    assert list(outcomes) == list(again) == list(runs)
    assert [again[out][0].reused for out in runs] == [True, False, True, True]


@pytest.mark.parametrize(
    "change", [{"seed": 1}, {"hand": "fourfinger"}, {"event": "drop"}, {"friction": "dry"}]
)
def test_runs_in_which_something_else_happens_are_not_made_together(tmp_path, change):
    runs = {
        tmp_path / "a": Settings("vary"),
        tmp_path / "b": dataclasses.replace(Settings("vary"), **change),
    }
    with pytest.raises(ValueError, match="expected settings that differ in tracker, .* alone, got"):
        generate_alike(runs, ["gelatin_box"], 1, [1.0])


def test_a_run_killed_in_the_middle_of_a_sequence_goes_on_and_gives_the_same_files(
    tmp_path, monkeypatch
):
    run(tmp_path / "whole")
    whole = {p.name: p.read_bytes() for p in (tmp_path / "whole").rglob("*.mcap")}
    update = sim.record.make_tracker
    calls = []

    def dying(*args):
        calls.append(args)
        if len(calls) == 2:
            raise KeyboardInterrupt
        return update(*args)

    monkeypatch.setattr(sim.record, "make_tracker", dying)
    with pytest.raises(KeyboardInterrupt):
        run(tmp_path / "killed")
    assert [p.name for p in (tmp_path / "killed").rglob("*.mcap")] == ["gelatin_box_0.mcap"]
    folder = tmp_path / "killed" / "vary"
    (folder / ".gelatin_box_1.mcap.123.tmp").write_text(
        "left by a process that had no time to clean up"
    )
    (folder / ".can_0.mcap.124.tmp").write_text("another run is at this one")
    outcomes = run(tmp_path / "killed")
    assert [outcome.reused for outcome in outcomes] == [True, False]
    assert [p.name for p in folder.glob("*.tmp")] == [".can_0.mcap.124.tmp"]
    assert {p.name: p.read_bytes() for p in (tmp_path / "killed").rglob("*.mcap")} == whole


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"seed": 1}, "seed 0, now 1"),
        ({"tracker": "depth-hand"}, "tracker depth, now depth-hand"),
        ({"scales": (1.0, 2.0)}, r"noise \[1.0\], now \[1.0, 2.0\]"),
        ({"calibration_error": True}, "calibration_error False, now True"),
    ],
)
def test_other_settings_do_not_mix_into_a_folder(tmp_path, spy, change, words):
    run(tmp_path, grasps=1)
    with pytest.raises(DatasetError, match=f"vary was made with {words}: give another --out"):
        run(tmp_path, grasps=1, **change)


def test_another_version_of_the_code_is_noticed(tmp_path, spy, caplog):
    run(tmp_path, grasps=1)
    file = tmp_path / "vary/dataset.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {"code": "older"}))
    run(tmp_path, grasps=1)
    assert "was begun by another version of this code; what is there is kept" in caplog.text


def test_rejected_samples_are_counted_with_their_reasons(tmp_path, spy, monkeypatch):
    sample = sequence.sample_sequence

    def rejecting(world, dataset, rng, event):
        if world.obj.name == "can":
            raise NotGraspable("isyhand cannot grasp can: 2 x slips", Counter({"slips": 2}))
        accepted = sample(world, dataset, rng, event)
        return dataclasses.replace(
            accepted, rejections=("slips", "overlaps the hand at the start", "slips")
        )

    monkeypatch.setattr(sequence, "sample_sequence", rejecting)
    outcomes = run(tmp_path, objects=("can", "gelatin_box"), grasps=1)
    assert [outcome.problem for outcome in outcomes] == ["isyhand cannot grasp can: 2 x slips", ""]
    with (tmp_path / "vary/rejected.csv").open() as file:
        rows = list(csv.reader(file))
    assert rows == [
        ["sequence", "accepted", "reason", "count"],
        ["can_0", "False", "slips", "2"],
        ["gelatin_box_0", "True", "overlaps the hand at the start", "1"],
        ["gelatin_box_0", "True", "slips", "2"],
    ]
    assert not (tmp_path / "vary/can_0.mcap").exists()
    again = run(tmp_path, objects=("can", "gelatin_box"), grasps=1)
    assert [outcome.reused for outcome in again] == [True, True]
    assert [outcome.rejections for outcome in again] == [outcome.rejections for outcome in outcomes]


def test_an_object_that_cannot_be_simulated_fails_alone_and_is_tried_again(
    tmp_path, spy, monkeypatch
):
    find = sequence.find_object

    def broken(name, ycb):
        if name == "can":
            raise MeshError("no mesh")
        return find(name, ycb)

    monkeypatch.setattr(sequence, "find_object", broken)
    outcomes = run(tmp_path, objects=("can", "gelatin_box"), grasps=1)
    assert [outcome.problem for outcome in outcomes] == ["no mesh", ""]
    monkeypatch.setattr(sequence, "find_object", find)
    outcomes = run(tmp_path, objects=("can", "gelatin_box"), grasps=1)
    assert [outcome.problem for outcome in outcomes] == ["", ""]
