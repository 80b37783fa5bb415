# SPDX-License-Identifier: MIT
"""Visual poses of other programs in a recording: `vtgtsam attach-vision`."""

import shutil
import sys

import gtsam
import numpy as np
import pytest
import trimesh
from held_box import HAND_XML, PADS, box_obj, write_grasp

from vtgtsam import cli, evaluate, read_recording
from vtgtsam.recording import RecordingWriter
from vtgtsam.recording.mcap_file import McapFile

FRAMES = 12


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Attach and read what was written: exit code, stdout, stderr and the recording or None."""

    def call(recording, poses, *options):
        out = tmp_path / "out.mcap"
        arguments = ["attach-vision", recording, poses, "--out", out, "--force", *options]
        monkeypatch.setattr(sys, "argv", ["vtgtsam", *map(str, arguments)])
        try:
            cli.main()
            code = 0
        except SystemExit as stopped:
            code = stopped.code or 0
        return code, *capsys.readouterr(), read_recording(out) if out.is_file() else None

    return call


def matrices(folder, poses):
    folder.mkdir()
    for k, pose in enumerate(poses):
        np.savetxt(folder / f"{k:07d}.txt", pose.matrix())
    return folder


def tum(path, times, poses):
    with path.open("w") as file:
        for time, pose in zip(times, poses, strict=True):
            numbers = [time, *pose.translation(), *pose.rotation().toQuaternion().coeffs()]
            print(*numbers, file=file)
    return path


def in_camera(recording, poses):
    return [recording.camera_pose.between(T) for T in poses]


def truth_of(recording):
    return list(recording.ground_truth.poses)


def assert_visual(recording, expected, atol=1e-6):
    found = recording.visual_poses.poses
    assert len(found) == len(expected)
    assert all(a.equals(b, atol) for a, b in zip(found, expected, strict=True))


@pytest.fixture
def source(tmp_path):
    return write_grasp(tmp_path / "in" / "a.mcap", frames=FRAMES)


@pytest.fixture
def before(source):
    return read_recording(source)


@pytest.mark.parametrize("method", ["vis", "vis+pen"])
def test_what_evaluate_exports_comes_back_as_it_was(tmp_path, run, method):
    write_grasp(tmp_path / "in" / "b.mcap", seed=3, frames=FRAMES)
    source = write_grasp(tmp_path / "in" / "a.mcap", frames=FRAMES)
    evaluate(tmp_path / "in", ("vis", "vis+pen"), "tuned", tmp_path / "results")
    _, _, _, from_tum = run(source, tmp_path / "results" / "tum" / method / "a.txt")
    bop = tmp_path / "results" / "bop" / f"{method}.csv"
    code, out, err, from_bop = run(source, bop, "--scene", 1)
    assert (code, err) == (0, "")
    assert f"{FRAMES} visual poses from {bop} (BOP csv, camera frame" in out
    np.testing.assert_array_equal(from_bop.visual_poses.times, from_tum.visual_poses.times)
    assert_visual(from_bop, from_tum.visual_poses.poses, 1e-9)
    if method == "vis":
        assert_visual(from_bop, read_recording(source).visual_poses.poses, 1e-9)


def test_a_folder_of_foundation_pose_takes_the_place_of_the_visual_poses(
    tmp_path, run, source, before
):
    folder = matrices(tmp_path / "ob_in_cam", in_camera(before, truth_of(before)))
    code, _, err, after = run(source, folder, "--tracker", "foundationpose")
    assert (code, err) == (0, "")
    assert_visual(after, truth_of(before))
    assert after.info["tracker"] == "foundationpose"
    assert after.info["tracker_files"] == "ob_in_cam"


def test_all_else_stays_byte_for_byte(tmp_path, run, source, before):
    poses = tum(tmp_path / "x.txt", before.ground_truth.times, truth_of(before))
    run(source, poses)
    old, new = McapFile(source), McapFile(tmp_path / "out.mcap")
    others = set(read_recording(source)._present) - {"/vision/object_pose"}

    def content(file):
        return [(m.topic, m.msgtype, m.receive_ns, m.data) for m in file.messages(others)]

    assert content(old) == content(new)
    assert len(content(old)) > 4 * FRAMES
    assert old.attachments == new.attachments
    assert new.metadata["vtgtsam"] == old.metadata["vtgtsam"] | {
        "tracker": "files",
        "tracker_files": "x.txt",
    }
    assert new.topics == old.topics
    stamps = [m.receive_ns for m in new.messages()]
    assert stamps == sorted(stamps)


def test_the_same_call_gives_the_same_bytes(tmp_path, run, source, before):
    poses = tum(tmp_path / "x.txt", before.ground_truth.times, truth_of(before))
    run(source, poses)
    first = (tmp_path / "out.mcap").read_bytes()
    run(source, poses)
    assert (tmp_path / "out.mcap").read_bytes() == first


def test_a_recording_without_visual_poses_gets_some(tmp_path, run):
    source = write_grasp(tmp_path / "a.mcap", frames=FRAMES, silent=(0, FRAMES))
    before = read_recording(source)
    assert before.visual_poses is None
    poses = tum(tmp_path / "x.txt", before.ground_truth.times, truth_of(before))
    code, out, _, after = run(source, poses)
    assert code == 0
    assert "in the place of 0" in out
    assert_visual(after, truth_of(before))
    assert len(after.measurements()) == FRAMES


def write_images(path, poses, mesh=None, origin="0 0 0"):
    """A recording of a hand at rest with poses as truth and an image for each."""
    info, mesh = {"object": "box", "object_origin": origin}, mesh or box_obj()
    with RecordingWriter(path, info, hand_xml=HAND_XML, mesh=mesh) as writer:
        writer.camera_pose(0.0, gtsam.Pose3(gtsam.Rot3(), [0.0, 0.0, -0.7]))
        for k, pose in enumerate(poses):
            writer.joint_states(0.1 * k, [f"j_{name}" for name in PADS], np.zeros(4))
            writer.tactile(0.1 * k, PADS, np.zeros(4), np.zeros(4))
            writer.truth(0.1 * k, pose)
            writer.depth(0.1 * k, np.ones((2, 2)))
            if k % 2 == 0:
                writer.object_pose(0.1 * k, pose)
    return path


def test_how_long_the_replaced_trackers_errors_stayed_goes_with_its_poses(tmp_path, run):
    poses = [gtsam.Pose3(gtsam.Rot3(), [0.01 * k, 0.0, 0.0]) for k in range(8)]
    with RecordingWriter(tmp_path / "a.mcap", {}, hand_xml=HAND_XML, mesh=box_obj()) as writer:
        for k, pose in enumerate(poses):
            writer.joint_states(0.1 * k, [f"j_{name}" for name in PADS], np.zeros(4))
            writer.tactile(0.1 * k, PADS, np.zeros(4), np.zeros(4))
            writer.vision_correlation(0.1 * k, 3.0)
            writer.object_pose(0.1 * k, pose)
    before = read_recording(tmp_path / "a.mcap")
    assert {m.visual_correlation for m in before.measurements()} == {3.0}
    after = run(tmp_path / "a.mcap", tum(tmp_path / "x.txt", 0.1 * np.arange(8), poses))[3]
    assert {m.visual_correlation for m in after.measurements()} == {0.0}


def test_numbers_count_images_where_there_are_any_or_visual_poses_where_said(tmp_path, run):
    poses = [gtsam.Pose3(gtsam.Rot3(), [0.01 * k, 0.0, 0.0]) for k in range(8)]
    source = write_images(tmp_path / "a.mcap", poses)
    before = read_recording(source)
    folder = matrices(tmp_path / "some", in_camera(before, poses[:4]))
    times = run(source, folder)[3].visual_poses.times
    assert times.tolist() == pytest.approx([0.0, 0.1, 0.2, 0.3])
    counted = run(source, folder, "--count", "vision")[3]
    assert counted.visual_poses.times.tolist() == pytest.approx([0.0, 0.2, 0.4, 0.6])


def test_latency_is_taken_off_and_poses_outside_are_left_out(tmp_path, run, source, before):
    times = before.ground_truth.times
    poses = [*truth_of(before), gtsam.Pose3()]
    late = tum(tmp_path / "x.txt", [*(times + 0.4), 100.0], poses)
    code, _, err, after = run(source, late, "--latency", 0.4)
    assert code == 0
    assert err == "warning: 1 of 13 poses are left out, they lie outside the recording's time\n"
    np.testing.assert_allclose(after.visual_poses.times, times, atol=1e-9)


@pytest.mark.parametrize("truth", [True, False])
@pytest.mark.parametrize("silent", [(0, 0), (0, FRAMES)])
def test_millimetres_are_noticed_whatever_the_recording_knows(tmp_path, run, truth, silent):
    known = read_recording(write_grasp(tmp_path / "known.mcap", frames=FRAMES))
    source = write_grasp(tmp_path / "a.mcap", frames=FRAMES, truth=truth, silent=silent)
    poses = [
        gtsam.Pose3(T.rotation(), 1e3 * T.translation()) for T in in_camera(known, truth_of(known))
    ]
    stamped = tum(tmp_path / "x.txt", known.ground_truth.times, poses)
    code, out, err, after = run(source, stamped, "--frame", "camera")
    assert (code, out, after) == (1, "", None)
    reference = (
        "the true pose" if truth else "the hand" if silent[1] else "the recorded visual pose"
    )
    assert f"m from {reference}: its poses look like millimetres; give --scale 0.001" in err
    assert err.count("\n") == 1
    code, _, err, after = run(source, stamped, "--frame", "camera", "--scale", 0.001)
    assert (code, err) == (0, "")
    assert_visual(after, truth_of(known))


def test_metres_in_a_bop_file_are_noticed(tmp_path, run, source, before):
    lines = ["scene_id,im_id,obj_id,score,R,t,time"]
    for k, T in enumerate(in_camera(before, truth_of(before))):
        R, t = (" ".join(map(str, np.ravel(x))) for x in (T.rotation().matrix(), T.translation()))
        lines.append(f"1,{k},1,1.0,{R},{t},-1")
    (tmp_path / "x.csv").write_text("\n".join(lines))
    code, _, err, _ = run(source, tmp_path / "x.csv")
    assert code == 1
    assert "look like metres; give --scale 1\n" in err


def test_the_other_frame_is_noticed(tmp_path, run, source, before):
    times, poses = before.ground_truth.times, truth_of(before)
    _, _, err, _ = run(source, tum(tmp_path / "c.txt", times, in_camera(before, poses)))
    assert "look like poses in the camera frame; give --frame camera\n" in err
    _, _, err, _ = run(source, tum(tmp_path / "w.txt", times, poses), "--frame", "camera")
    assert "look like poses in the world frame; give --frame world\n" in err
    mm = [gtsam.Pose3(T.rotation(), 1e3 * T.translation()) for T in in_camera(before, poses)]
    _, _, err, _ = run(source, tum(tmp_path / "both.txt", times, mm))
    assert "millimetres and poses in the camera frame; give --scale 0.001 --frame camera\n" in err


def w_first(path):
    """The same TUM file with its quaternions as qw qx qy qz."""
    lines = [line.split() for line in path.read_text().splitlines()]
    path.write_text("\n".join(" ".join([*n[:4], n[7], *n[4:7]]) for n in lines))
    return path


@pytest.mark.parametrize("frame", ["world", "camera"])
def test_quaternions_with_w_first_are_refused(tmp_path, run, frame):
    turns = [gtsam.Rot3.RzRyRx(0.6 + 0.1 * k, -0.5, 0.8) for k in range(8)]
    truth = [gtsam.Pose3(R, [0.0, 0.01 * k, 0.0]) for k, R in enumerate(turns)]
    source = write_images(tmp_path / "a.mcap", truth)
    poses = truth if frame == "world" else in_camera(read_recording(source), truth)
    written = tum(tmp_path / "x.txt", 0.1 * np.arange(8), poses)
    assert run(source, written, "--frame", frame)[0] == 0
    (tmp_path / "out.mcap").unlink()
    code, _, err, after = run(source, w_first(written), "--frame", frame)
    assert (code, after) == (1, None)
    assert "0 degrees with its quaternions read as qw qx qy qz; write them as qx qy qz qw" in err
    assert err.count("\n") == 1


def test_what_looks_the_same_turned_is_no_matter_of_quaternions(tmp_path, run):
    """A box at half a turn about z, seen as not turned: with w first that would be half a turn."""
    truth = [gtsam.Pose3(gtsam.Rot3.Rz(np.pi), [0.0, 0.01 * k, 0.0]) for k in range(8)]
    source = write_images(tmp_path / "a.mcap", truth)
    seen = [gtsam.Pose3(gtsam.Rot3(), T.translation()) for T in truth]
    code, _, err, after = run(source, tum(tmp_path / "x.txt", 0.1 * np.arange(8), seen))
    assert (code, err) == (0, "")
    assert_visual(after, seen)


def test_poses_that_are_merely_bad_get_a_warning(tmp_path, run, source, before):
    away = gtsam.Pose3(gtsam.Rot3.Rx(1.0), [0.07, 0.4, -0.3])
    poses = [away * T for T in truth_of(before)]
    code, _, err, after = run(source, tum(tmp_path / "x.txt", before.ground_truth.times, poses))
    assert code == 0
    assert "visual poses are off the true ones by" in err
    assert "check --frame, --scale, --latency" in err
    assert err.count("\n") == 1
    out = shutil.copy(tmp_path / "out.mcap", tmp_path / "bad.mcap")
    good = tum(tmp_path / "y.txt", before.ground_truth.times, truth_of(before))
    assert run(out, good)[2] == ""  # the poses that go are not complained of
    _, _, _, after = run(source, tmp_path / "x.txt")
    assert_visual(after, poses)


def test_a_mesh_with_another_origin_is_noticed_and_its_offset_given(tmp_path, run, source, before):
    offset = np.array([0.004, -0.02, 0.011])
    shift = gtsam.Pose3(gtsam.Rot3(), offset)
    poses = [T * shift for T in truth_of(before)]
    stamped = tum(tmp_path / "x.txt", before.ground_truth.times, poses)
    code, _, err, after = run(source, stamped)
    assert code == 0
    assert (
        "poses lie 23.2 mm from the true pose, the same way in every image to within 0.0 mm" in err
    )
    assert "if so, give --offset=0.0040,-0.0200,0.0110; otherwise this is the tracker's own" in err
    assert err.endswith("error: do not remove it with the truth\n")
    assert_visual(after, poses)
    code, _, err, after = run(source, stamped, "--offset=0.0040,-0.0200,0.0110")
    assert (code, err) == (0, "")
    assert_visual(after, truth_of(before))
    _, _, err, after = run(source, stamped, "--offset=0,0,0")
    assert err == ""  # said to be right
    assert_visual(after, poses)


@pytest.mark.parametrize(
    ("origin", "where"), [("file", (-0.03, 0.0, 0.0)), ("center", (0.02, 0.02, 0.0))]
)
def test_the_usual_origins_are_known_by_name(tmp_path, run, origin, where):
    mesh = trimesh.creation.box((0.04, 0.06, 0.08))
    mesh.apply_translation((0.05, 0.02, 0.0))
    truth = [gtsam.Pose3(gtsam.Rot3.Rx(0.2 * k), [0.0, 0.01 * k, 0.0]) for k in range(8)]
    source = write_images(
        tmp_path / "a.mcap", truth, mesh.export(file_type="obj").encode(), "0.03 0 0"
    )
    poses = [T * gtsam.Pose3(gtsam.Rot3(), where) for T in truth]
    stamped = tum(tmp_path / "x.txt", 0.1 * np.arange(8), poses)
    _, _, err, _ = run(source, stamped)
    assert f"give --offset={origin}; otherwise" in err
    code, _, err, after = run(source, stamped, "--offset", origin)
    assert (code, err) == (0, "")
    assert_visual(after, truth)


def test_an_error_that_moves_with_the_hand_is_no_matter_of_the_mesh(tmp_path, run, source, before):
    poses = [
        gtsam.Pose3(T.rotation(), T.translation() + [0.0, 0.0, 0.01]) for T in truth_of(before)
    ]
    _, _, err, _ = run(source, tum(tmp_path / "x.txt", before.ground_truth.times, poses))
    assert err == ""


def test_a_file_that_is_there_is_replaced_only_where_that_is_said(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(
        sys, "argv", ["vtgtsam", "attach-vision", "a.mcap", "x.txt", "--out", str(tmp_path / "b")]
    )
    (tmp_path / "b").write_text("work of a day")
    with pytest.raises(SystemExit):
        cli.main()
    assert "b is there already; give another name, or --force" in capsys.readouterr().err
    assert (tmp_path / "b").read_text() == "work of a day"


@pytest.mark.parametrize(
    ("times", "words"),
    [(1e9, "are the stamps of one clock"), (-50.0, "from -49.00 to -48.64 s, the recording from")],
)
def test_poses_of_another_time_are_refused(tmp_path, run, source, before, times, words):
    poses = tum(tmp_path / "x.txt", before.ground_truth.times + times, truth_of(before))
    code, _, err, after = run(source, poses)
    assert (code, after) == (1, None)
    assert words in err


def test_matrices_that_are_no_poses_are_left_out(tmp_path, run, source, before):
    folder = matrices(tmp_path / "m", in_camera(before, truth_of(before)))
    np.savetxt(folder / "0000003.txt", np.full((4, 4), np.nan))
    _, _, err, after = run(source, folder)
    assert err == (
        "warning: 1 of 12 poses are left out, they are no rotation and translation of finite numbers\n"
    )
    assert len(after.visual_poses) == FRAMES - 1


def test_camera_poses_need_a_camera(tmp_path, run):
    source = write_grasp(tmp_path / "a.mcap", frames=FRAMES, camera=False)
    folder = matrices(tmp_path / "m", [gtsam.Pose3()] * FRAMES)
    code, _, err, _ = run(source, folder)
    assert code == 1
    assert "does not say where the camera is (/camera/pose)" in err


def test_wrong_calls_are_refused(tmp_path, run, source, before):
    poses = tum(tmp_path / "x.txt", before.ground_truth.times, truth_of(before))
    assert run(source, poses, "--offset", "1,2")[0] == 2
    assert run(source, poses, "--offset", "nan,0,0")[0] == 2
    assert run(source, poses, "--scale", "0")[0] == 2
    for wrong in ("nan", "inf"):
        code, _, err, _ = run(source, poses, "--latency", wrong)
        assert (code, f"'--latency': expected a finite number, got {wrong}" in err) == (2, True)
    assert run(source, poses, "--frame", "hand")[0] == 2
    code, _, err, _ = run(source, poses, "--out", source)
    assert (code, "--out must be another file than" in err) == (1, True)
    code, _, err, _ = run(tmp_path, poses)
    assert (code, "must be an .mcap file" in err) == (1, True)
    assert read_recording(source).visual_poses.poses[0].equals(before.visual_poses.poses[0], 0.0)
