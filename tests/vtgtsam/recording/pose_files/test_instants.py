# SPDX-License-Identifier: MIT
"""Poses of other programs on the instants that they are of, or refused in a sentence that says what to type."""

import gtsam
import numpy as np
import pytest
from held_box import HAND_XML, PADS, box_obj

from vtgtsam.exceptions import RecordingError
from vtgtsam.recording import RecordingWriter, load_topics, read_recording
from vtgtsam.recording.pose_files import PoseFiles
from vtgtsam.recording.pose_files.attach import attach_vision
from vtgtsam.recording.pose_files.numbering import Numbering

IMAGES = 120
TIMES = 1.0 + np.arange(IMAGES) / 30  # [s]
CAMERA = gtsam.Pose3(gtsam.Rot3.Rx(np.pi), [0.0, 0.0, 1.0])


def held(t):
    """The object lies still, is lifted and turned from 2 s to 4 s, and is held still."""
    share = 0.5 - 0.5 * np.cos(np.pi * np.clip((t - 2) / 2, 0, 1))
    return gtsam.Pose3(gtsam.Rot3.Ry(share), [0.0, 0.02 * share, 0.15 * share])


def write(path, still=False, truth=True, images=False):
    info = {"object": "box"}
    with RecordingWriter(path, info, hand_xml=HAND_XML, mesh=box_obj()) as writer:
        writer.camera_pose(1.0, CAMERA)
        for t in TIMES:
            writer.joint_states(t, [f"j_{name}" for name in PADS], np.zeros(4))
            writer.tactile(t, PADS, np.zeros(4), np.zeros(4))
            if truth:
                writer.truth(t, held(0.0 if still else t))
            if images:
                writer.depth(t, np.ones((2, 2)))
            else:
                writer.object_pose(t, held(0.0 if still else t))
    return path


def seen(times, noise=1e-3, seed=0):
    """What a tracker with this noise [m] sees of the object, in the camera frame."""
    rng = np.random.default_rng(seed)
    sigma = [noise * 5] * 3 + [noise] * 3
    return [CAMERA.between(held(t)) * gtsam.Pose3.Expmap(rng.normal(0, sigma)) for t in times]


def numbered(folder, poses, numbers):
    folder.mkdir()
    for number, pose in zip(numbers, poses, strict=True):
        np.savetxt(folder / f"{number:06d}.txt", pose.matrix())
    return folder


def tum(path, stamps, poses):
    with path.open("w") as file:
        for stamp, pose in zip(stamps, poses, strict=True):
            print(stamp, *pose.translation(), *pose.rotation().toQuaternion().coeffs(), file=file)
    return path


def attach(tmp_path, poses, recording=None, numbering=None, **options):
    """Times of the visual poses that the copy has, what was said, and the copy."""
    out, read = tmp_path / "out.mcap", {"numbering": numbering, **options}
    known = {"latency_is_known": "latency" in options}
    files = PoseFiles.read(poses, frame="camera", **read)
    done = attach_vision(recording or write(tmp_path / "a.mcap"), files, out, **known)
    return read_recording(out).visual_poses.times, done


CHOICES = {
    "every 2nd": (slice(None, None, 2), "--first 0 --every 2"),
    "every 3rd": (slice(None, None, 3), "--first 0 --every 3"),
    "every 3rd from image 1 on": (slice(1, None, 3), "--first 1 --every 3"),
    "begun late": (slice(37, None), "--first 37"),
}


@pytest.mark.parametrize("name", CHOICES)
@pytest.mark.parametrize("images", [True, False])
def test_images_that_were_left_out_before_numbering_are_noticed(tmp_path, name, images):
    which, options = CHOICES[name]
    poses = seen(TIMES)[which]
    folder = numbered(tmp_path / "ob_in_cam", poses, range(len(poses)))
    source = write(tmp_path / "a.mcap", images=images)
    with pytest.raises(
        RecordingError, match=f"give {options} if that is what they are, or --first 0"
    ):
        attach(tmp_path, folder, source)
    assert not (tmp_path / "out.mcap").exists()
    words = options.split()
    said = Numbering(int(words[1]), int(words[3]) if len(words) > 2 else 1)
    times, done = attach(tmp_path, folder, source, numbering=said)
    np.testing.assert_allclose(times, TIMES[which], atol=1e-6)
    first = np.arange(IMAGES)[which]
    assert (
        f"as images {first[0]} to {first[-1]} of 120, counted from 0; last pose at" in done.matched
    )


def test_numbers_that_count_images_are_taken_at_their_word(tmp_path):
    for k, which in enumerate([slice(None), slice(None, None, 2), slice(0, 90), slice(50, 60)]):
        numbers = range(IMAGES)[which]
        folder = numbered(tmp_path / f"m{k}", seen(TIMES)[which], numbers)
        times, done = attach(tmp_path, folder)
        np.testing.assert_allclose(times, TIMES[which], atol=1e-6)
        assert done.warnings == []
        assert f"numbers {numbers[0]} to {numbers[-1]} as images {numbers[0]} to" in done.matched


def test_numbers_from_one_on_are_one_image_off_unless_the_motion_says_so(tmp_path):
    folder = numbered(tmp_path / "bop", seen(TIMES)[:-2], range(1, IMAGES - 1))
    with pytest.raises(
        RecordingError, match="give --first 0 if that is what they are, or --first 1"
    ):
        attach(tmp_path, folder)
    times, _ = attach(tmp_path, folder, numbering=Numbering(0))
    np.testing.assert_allclose(times, TIMES[:-2], atol=1e-6)


def test_numbers_that_an_object_at_rest_cannot_tell_apart_are_refused(tmp_path):
    source = write(tmp_path / "still.mcap", still=True)
    folder = numbered(tmp_path / "m", seen(np.zeros(60)), range(60))
    with pytest.raises(
        RecordingError, match="nothing in it tells which they are: images from image 0"
    ):
        attach(tmp_path, folder, source)
    times, _ = attach(tmp_path, folder, source, numbering=Numbering(0, 2))
    np.testing.assert_allclose(times, TIMES[::2], atol=1e-6)
    with pytest.raises(RecordingError, match=r"poses of images 70 to 129 \(--first, --every\)"):
        attach(tmp_path, folder, source, numbering=Numbering(70))


@pytest.mark.parametrize("shift", [0.15, -0.3, 0.6])
def test_stamps_of_another_clock_are_refused_and_the_shift_is_named(tmp_path, shift):
    poses = tum(tmp_path / "x.txt", TIMES + shift, seen(TIMES))
    with pytest.raises(RecordingError, match=f"Give --latency {shift:.2f}, or --latency 0 if"):
        attach(tmp_path, poses)
    times, done = attach(tmp_path, poses, latency=shift)
    np.testing.assert_allclose(times, TIMES, atol=1e-6)
    assert done.warnings == []


def test_a_short_delay_gets_a_warning_for_it_may_be_the_trackers_own(tmp_path):
    _, done = attach(tmp_path, tum(tmp_path / "x.txt", TIMES + 0.05, seen(TIMES)))
    (warning,) = done.warnings
    assert "follow the true pose better 0.05 s earlier" in warning
    assert warning.endswith("if the tracker stamps when it is done, give --latency 0.05")


@pytest.mark.parametrize("seed", range(5))
def test_poses_that_are_merely_noisy_are_of_their_instants(tmp_path, seed):
    poses = tum(tmp_path / "x.txt", TIMES, seen(TIMES, noise=8e-3, seed=seed))
    times, done = attach(tmp_path, poses)
    np.testing.assert_allclose(times, TIMES, atol=1e-6)
    assert done.warnings == []


@pytest.mark.parametrize(
    ("scale", "unit"), [(1e9, "nanoseconds"), (1e6, "microseconds"), (1e3, "milliseconds")]
)
def test_stamps_in_another_unit_are_named(tmp_path, scale, unit):
    stamps = [f"{scale * t:.0f}" for t in TIMES]
    poses = tum(tmp_path / "x.txt", stamps, seen(TIMES))
    with pytest.raises(RecordingError, match=f"{unit}.*--time-scale {1 / scale:g}"):
        attach(tmp_path, poses)
    times, _ = attach(tmp_path, poses, time_scale=1 / scale)
    np.testing.assert_allclose(times, TIMES, atol=1e-3)


def test_stamps_in_whole_seconds_are_refused(tmp_path):
    poses = tum(tmp_path / "x.txt", [f"{t:.0f}" for t in TIMES], seen(TIMES))
    with pytest.raises(RecordingError, match="120 poses in .* have only 5 different stamps"):
        attach(tmp_path, poses)


def test_nanoseconds_since_1970_keep_every_digit(tmp_path):
    path = tmp_path / "x.txt"
    path.write_text("1581120424100262102 0 0 0 0 0 0 1\n")
    assert PoseFiles.read(path, time_scale=1e-9).table.stamps_ns.tolist() == [1581120424100262102]
    with pytest.raises(RecordingError, match="line 1: 1581120424100262102 s is no instant"):
        PoseFiles.read(path)


MAP = """
object: box.obj
hand: hand.xml
topics:
  joints: /joint_states
  contacts: /tactile/contacts
  camera_pose: [0, 0, 1, 1, 0, 0, 0]
  vision: {topic: /their/tracker, latency: 0.06, frame: camera}
  images: /camera/depth
"""


def test_another_robots_recording_is_read_through_its_map_before_and_after(tmp_path):
    (tmp_path / "map.yaml").write_text(MAP)
    (tmp_path / "box.obj").write_bytes(box_obj())
    (tmp_path / "hand.xml").write_text(HAND_XML)
    topics = load_topics(tmp_path / "map.yaml")
    source = write(tmp_path / "a.mcap", images=True)
    folder = numbered(tmp_path / "m", seen(TIMES, noise=0.0), range(IMAGES))
    done = attach_vision(source, PoseFiles.read(folder), tmp_path / "b.mcap", topics=topics)
    assert done.count == IMAGES
    after = read_recording(tmp_path / "b.mcap", topics=topics)
    np.testing.assert_allclose(after.visual_poses.times, TIMES, atol=1e-6)
    for t, pose in zip(TIMES, after.visual_poses.poses, strict=True):
        assert pose.equals(held(t), 1e-6)
    wrong = topics.model_copy(update={"topics": topics.topics.model_copy(update={"images": "/x"})})
    with pytest.raises(RecordingError, match=r"has no topic /x \(images\)"):
        attach_vision(source, PoseFiles.read(folder), tmp_path / "c.mcap", topics=wrong)
