# SPDX-License-Identifier: MIT
"""Poses as FoundationPose, bop_toolkit and evo write them."""

import gtsam
import numpy as np
import pytest

from vtgtsam.exceptions import RecordingError
from vtgtsam.recording.pose_files import PoseFiles

POSES = [gtsam.Pose3(gtsam.Rot3.RzRyRx(0.3 * k, -0.2, 0.9), [0.1 * k, -0.2, 0.7]) for k in range(4)]
TIMES = [1.0 + 0.033 * k for k in range(4)]


def foundation_pose(folder, poses=POSES, names=("0000000", "0000001", "0000002", "0000003")):
    """What its run_demo.py does: np.savetxt(f'{debug_dir}/ob_in_cam/{id}.txt', pose)."""
    folder.mkdir()
    for name, pose in zip(names, poses, strict=False):
        np.savetxt(folder / f"{name}.txt", pose.matrix().reshape(4, 4))
    return folder


def tum(path, poses=POSES, times=TIMES):
    lines = ["# a comment\n"]
    for time, pose in zip(times, poses, strict=True):
        numbers = [time, *pose.translation(), *pose.rotation().toQuaternion().coeffs()]
        lines.append(" ".join(f"{x:.9f}" for x in numbers) + "\n")
    path.write_text("".join(lines))
    return path


def bop(path, rows):
    """Rows of scene, image, object, score and pose, as bop_toolkit's inout.save_bop_results."""
    lines = ["scene_id,im_id,obj_id,score,R,t,time"]
    for scene, image, obj, score, pose in rows:
        R = " ".join(map(str, pose.rotation().matrix().flatten().tolist()))
        t = " ".join(map(str, (1e3 * pose.translation()).tolist()))
        lines.append(f"{scene},{image},{obj},{score},{R},{t},-1")
    path.write_text("\n".join(lines))
    return path


def assert_same(found, expected, atol=1e-8):
    assert len(found) == len(expected)
    for a, b in zip(found, expected, strict=True):
        assert (a is None) == (b is None)
        assert a is None or a.equals(b, atol)


def test_a_folder_of_matrices_has_camera_poses_in_metres_by_image(tmp_path):
    files = PoseFiles.read(foundation_pose(tmp_path / "ob_in_cam"))
    assert (files.frame, files.scale) == ("camera", 1.0)
    assert_same(files.poses, POSES)
    np.testing.assert_array_equal(files.times_ns([*TIMES, 1.132]), np.rint(np.array(TIMES) * 1e9))


def test_a_bop_csv_has_camera_poses_in_millimetres(tmp_path):
    files = PoseFiles.read(
        bop(tmp_path / "x.csv", [(1, k, 5, 1.0, T) for k, T in enumerate(POSES)])
    )
    assert (files.frame, files.scale) == ("camera", 0.001)
    assert_same(files.poses, POSES)


def test_a_tum_file_has_world_poses_in_metres_by_time(tmp_path):
    files = PoseFiles.read(tum(tmp_path / "x.txt"))
    assert (files.frame, files.scale) == ("world", 1.0)
    assert_same(files.poses, POSES)
    np.testing.assert_array_equal(files.times_ns([]), np.rint(np.array(TIMES) * 1e9))


def test_of_several_poses_in_an_image_the_one_with_the_highest_score_counts(tmp_path):
    rows = [(1, 0, 5, 0.3, POSES[0]), (1, 0, 5, 0.9, POSES[1]), (1, 0, 5, 0.5, POSES[2])]
    assert_same(PoseFiles.read(bop(tmp_path / "x.csv", rows)).poses, [POSES[1]])


def test_one_scene_and_object_of_several_are_chosen(tmp_path):
    rows = [(1, 0, 5, 1, POSES[0]), (2, 0, 5, 1, POSES[1]), (2, 0, 6, 1, POSES[2])]
    path = bop(tmp_path / "x.csv", rows)
    assert_same(PoseFiles.read(path, scene=2, obj=6).poses, [POSES[2]])
    with pytest.raises(RecordingError, match="several scenes; choose one with --scene: 1, 2"):
        PoseFiles.read(path)
    with pytest.raises(RecordingError, match="several objects; choose one with --object-id: 5, 6"):
        PoseFiles.read(path, scene=2)
    with pytest.raises(RecordingError, match="no scene 7; choose one with --scene: 1, 2"):
        PoseFiles.read(path, scene=7)


def test_scale_frame_and_latency_are_as_the_caller_says(tmp_path):
    half = [gtsam.Pose3(T.rotation(), 0.5 * T.translation()) for T in POSES]
    files = PoseFiles.read(tum(tmp_path / "x.txt"), scale=0.5, frame="camera", latency=0.25)
    assert files.frame == "camera"
    assert_same(files.poses, half)
    np.testing.assert_allclose(files.times_ns([]) / 1e9, np.array(TIMES) - 0.25)


def test_an_offset_is_where_the_programs_origin_lies_in_the_object_frame(tmp_path):
    offset = np.array([0.01, -0.03, 0.2])
    files = PoseFiles.read(tum(tmp_path / "x.txt"), offset=offset)
    for T_wo, T_wt in zip(files.poses, POSES, strict=True):
        np.testing.assert_allclose(T_wo.transformFrom(offset), T_wt.translation(), atol=1e-8)


@pytest.mark.parametrize(
    ("names", "count", "expected"),
    [
        (("0000000", "0000002"), 4, [0, 2]),  # image 1 was lost
        (("000001", "000002", "000004"), 4, [0, 1, 3]),  # counted from 1: there is an image 4
        (("frame_7", "frame_9", "frame_10"), 3, [0, 1, 2]),  # as many as images, in their order
        (("9", "10", "11"), 12, [9, 10, 11]),  # numbers, not texts
    ],
)
def test_names_of_matrices_count_images(tmp_path, names, count, expected):
    files = PoseFiles.read(foundation_pose(tmp_path / "x", names=names))
    np.testing.assert_array_equal(files.times_ns(np.arange(count)) / 1e9, expected)


@pytest.mark.parametrize(
    "names",
    [("12.033", "12.5"), ("1581120424100262102", "1581120424133000000")],
)
def test_names_of_matrices_may_be_stamps(tmp_path, names):
    files = PoseFiles.read(foundation_pose(tmp_path / "x", names=names))
    expected = [int(n) if len(n) == 19 else round(float(n) * 1e9) for n in names]
    np.testing.assert_array_equal(files.times_ns([]), expected)


def test_more_poses_than_images_are_refused(tmp_path):
    files = PoseFiles.read(foundation_pose(tmp_path / "x"))
    with pytest.raises(RecordingError, match="images 0 to 3, but there are 2 images"):
        files.times_ns([0.0, 0.1])


def test_what_is_no_pose_is_none_and_a_rounded_rotation_is_one(tmp_path):
    wrong = {
        "nan": np.full((4, 4), np.nan),
        "mirror": np.diag([1.0, 1.0, -1.0, 1.0]),
        "scaled": np.diag([10.0, 10.0, 10.0, 1.0]),
        "projective": np.eye(4) + np.eye(4, k=-3),
    }
    folder = foundation_pose(tmp_path / "x", [])
    for k, matrix in enumerate(wrong.values()):
        np.savetxt(folder / f"{k}.txt", matrix)
    np.savetxt(folder / "4.txt", POSES[2].matrix(), fmt="%.3f")
    *none, rounded = PoseFiles.read(folder).poses
    assert none == [None] * 4
    assert rounded.equals(POSES[2], 2e-3)
    R = rounded.rotation().matrix()
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=1e-12)


def test_a_quaternion_of_zeros_is_no_pose(tmp_path):
    (tmp_path / "x.txt").write_text("1.0 0 0 0 0 0 0 0\n2.0 0 0 0 0 0 0 1\n")
    assert_same(PoseFiles.read(tmp_path / "x.txt").poses, [None, gtsam.Pose3()])


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "holds no poses"),
        ("# only a comment\n", "holds no poses"),
        ("1 2 3\n", "line 1: expected 'time x y z qx qy qz qw'"),
        ("1 0 0 0 0 0 0 1\n2 0 0 zero 0 0 0 1\n", "line 2"),
        ("nan 0 0 0 0 0 0 1\n", "line 1"),
        ("scene_id,im_id,obj_id,R,t,time\n", "lacks BOP's columns score"),
        ("scene_id,im_id,obj_id,score,R,t,time\n", "holds no poses"),
        ("scene_id,im_id,obj_id,score,R,t,time\n1,0,1,1,1 0 0 0 1 0 0 0,0 0 0,-1\n", "line 2"),
        ("scene_id,im_id,obj_id,score,R,t,time\n1,0\n", "line 2"),
        (
            f"scene_id,im_id,obj_id,score,R,t,time\n1,{2**64},1,1,1 0 0 0 1 0 0 0 1,0 0 0,-1\n",
            "line 2 .*: 18446744073709551616 is no image's number",
        ),
    ],
)
def test_a_file_that_makes_no_sense_is_refused_in_one_sentence(tmp_path, content, words):
    (tmp_path / "x.txt").write_text(content)
    with pytest.raises(RecordingError, match=words):
        PoseFiles.read(tmp_path / "x.txt")


def test_a_folder_that_makes_no_sense_is_refused_in_one_sentence(tmp_path):
    with pytest.raises(RecordingError, match="does not exist"):
        PoseFiles.read(tmp_path / "nothing")
    with pytest.raises(RecordingError, match=r"holds no .txt files"):
        PoseFiles.read(tmp_path)
    mixed = foundation_pose(tmp_path / "mixed", names=("0", "1.5"))
    with pytest.raises(RecordingError, match="some files by stamps and some by numbers"):
        PoseFiles.read(mixed)
    for name in (str(2**64), f"{2**40}.5"):
        far = foundation_pose(tmp_path / name, names=(name,))
        with pytest.raises(RecordingError, match="is neither an image's nor a stamp"):
            PoseFiles.read(far)
    unnamed = foundation_pose(tmp_path / "unnamed", names=("pose",))
    with pytest.raises(RecordingError, match=r"pose.txt has no number in its name"):
        PoseFiles.read(unnamed)
    short = foundation_pose(tmp_path / "short", POSES[:1])
    (short / "1.txt").write_text("1 0 0 0")
    with pytest.raises(RecordingError, match=r"1.txt holds no 4x4 matrix"):
        PoseFiles.read(short)


@pytest.mark.parametrize(
    "options", [{"scale": 0.0}, {"scale": float("nan")}, {"latency": float("inf")},
                {"offset": (0, 0, float("nan"))}, {"offset": (0, 0)}],
)  # fmt: skip
def test_wrong_options_are_value_errors(tmp_path, options):
    with pytest.raises(ValueError):
        PoseFiles.read(tum(tmp_path / "x.txt"), **options)
