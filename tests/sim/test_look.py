# SPDX-License-Identifier: MIT
"""Pictures and films of a recording, from the recording alone."""

import sys

import gtsam
import numpy as np
import pytest
from graphics_needed import needs_graphics
from PIL import Image
from typer.testing import CliRunner

import sim.graphics
from sim.__main__ import app
from sim.appearance import color_of
from sim.look import encode, film
from sim.look.instants import Estimated, instants, read_estimates
from sim.look.sheet import contact_sheet
from sim.look.stage import Stage
from sim.look.views import find_views
from vtgtsam import ObjectModel, evaluate, load_hand, load_object, read_recording
from vtgtsam.evaluation.palette import OF_METHODS, rgb
from vtgtsam.exceptions import MeshError, RecordingError
from vtgtsam.recording import RecordingWriter
from vtgtsam.recording.provenance import mesh_file, object_metadata
from vtgtsam.recording.trajectory import PoseTrajectory

SIZE = (160, 120)
LINE = 16  # [pixels], of the caption below views of that size
SECONDS = 2.0
PAD = "pad_index_distal"
T_WC = gtsam.Pose3(
    gtsam.Rot3(np.array([[0, 0.69, -0.72], [1, 0, 0], [0, -0.72, -0.69]]).round(3)),
    [0.7, 0.05, 0.6],
)


def write(path, truth=True, touching=(PAD,), start=0.0, name="cube", hand_name="isyhand"):
    """An open hand with an object over its palm; for the second half, pads in contact."""
    hand, obj = load_hand("isyhand"), load_object(name)
    info = {"hand": hand_name, **object_metadata(obj)}
    with RecordingWriter(path, info, hand_xml=hand.xml, mesh=mesh_file(obj)) as writer:
        writer.camera_pose(start, T_WC)
        for k in range(round(SECONDS * 50) + 1):
            t = start + 0.02 * k
            writer.joint_states(t, hand.joint_names, np.zeros(len(hand.joint_names)))
            bits = [k >= 50 and pad in touching for pad in hand.pad_names]
            writer.tactile(t, hand.pad_names, np.array(bits, float), bits)
            T_wo = gtsam.Pose3(gtsam.Rot3(), [0.09 + 0.02 * k / 100, 0.056, 0.1])
            writer.object_pose(t, T_wo)
            if truth:
                writer.truth(t, T_wo)
    return path


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return write(tmp_path_factory.mktemp("look") / "cube_0.mcap")


def call(*arguments):
    return CliRunner().invoke(app, ["look", *map(str, arguments)])


def like(image, color, tolerance=0.12):
    """Which pixels have about a colour's hue and are no grey."""
    shades = image / np.maximum(image.max(axis=-1, keepdims=True), 1)
    wanted = np.array(color) / max(color)
    return (np.abs(shades - wanted) < tolerance).all(axis=-1)


def test_instants_are_evenly_spaced_and_say_what_is_shown(tmp_path):
    shown = instants(read_recording(write(tmp_path / "a.mcap", start=100.0)), rate=10.0)
    np.testing.assert_allclose([i.time for i in shown], np.arange(21) / 10, atol=1e-6)
    assert [i.contacts.sum() for i in shown] == [0] * 10 + [1] * 11
    np.testing.assert_allclose([i.T_wo[0, 3] for i in shown], 0.09 + 0.001 * np.arange(21))
    assert {i.phase for i in shown} == {"before the turn"}


def test_without_truth_the_visual_pose_is_shown_and_without_both_it_says_so(tmp_path):
    (shown, *_) = instants(read_recording(write(tmp_path / "a.mcap", truth=False)), rate=10.0)
    assert shown.T_wo[0, 3] == pytest.approx(0.09)
    with RecordingWriter(tmp_path / "b.mcap", hand_xml=load_hand("isyhand").xml) as writer:
        hand = load_hand("isyhand")
        for t in (0.0, 1.0):
            writer.joint_states(t, hand.joint_names, np.zeros(len(hand.joint_names)))
            writer.tactile(t, hand.pad_names, np.zeros(16), np.zeros(16))
    with pytest.raises(RecordingError, match="no poses of the object, true or visual, to draw"):
        instants(read_recording(tmp_path / "b.mcap"), rate=10.0)


@pytest.mark.parametrize("T_wc", [T_WC, None])
@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.0])
def test_both_views_show_all_points_and_little_else(T_wc, aspect):
    rng = np.random.default_rng(0)
    points = rng.uniform((-0.1, -0.2, 1.0), (0.2, 0.1, 1.2), (50, 3))
    for view in find_views(points, T_wc, aspect):
        camera = view.camera()
        azimuth, elevation = np.deg2rad([camera.azimuth, camera.elevation])
        forward = np.array(
            [
                np.cos(elevation) * np.cos(azimuth),
                np.cos(elevation) * np.sin(azimuth),
                np.sin(elevation),
            ]
        )  # as mujoco.mjvCamera defines its angles
        right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
        away = points - (camera.lookat - camera.distance * forward)
        depth, half = away @ forward, np.tan(np.deg2rad(view.fovy) / 2)
        x = away @ right / depth / (half * aspect)
        y = away @ np.cross(right, forward) / depth / half
        assert max(np.abs(x).max(), np.abs(y).max()) == pytest.approx(1 / 1.06, abs=0.01)
        assert abs(x.min() + x.max()) < 0.02 and abs(y.min() + y.max()) < 0.02


@needs_graphics
def test_a_sheet_shows_the_object_and_lights_up_what_touches(recording):
    sheet = contact_sheet(recording, 2, SIZE)
    width, height = SIZE
    assert sheet.shape == (2 * height + LINE, 2 * width, 3)
    views = sheet[: 2 * height].reshape(2, height, 2, width, 3).swapaxes(1, 2)
    cube = like(views, color_of("cube")).sum(axis=(2, 3))
    assert (cube > 150).all()
    yellow = like(views, (1.0, 0.88, 0.45), 0.15).sum(axis=(2, 3))
    assert (yellow[:, 0] == 0).all() and (yellow[:, 1] > 40).all()
    middle = views[:, :, height // 4 : 3 * height // 4, width // 4 : 3 * width // 4]
    assert (middle.std(axis=(2, 3, 4)) > 15).all()  # hand and object stand in the middle
    assert (sheet[-LINE:, :, :].min(axis=(0, 2)) < 128).any()  # words


@needs_graphics
def test_a_hand_that_only_the_recording_knows_is_drawn(tmp_path, recording):
    known = contact_sheet(recording, 1, SIZE)
    alone = contact_sheet(write(tmp_path / "a.mcap", hand_name="of my own"), 1, SIZE)
    changed = (known != alone).any(axis=-1).mean()
    assert 0.0 < changed < 0.2  # it has no forearm


@needs_graphics
def test_an_object_that_is_known_by_its_field_alone_is_refused_in_one_sentence(recording):
    alone = ObjectModel("cube", load_object("cube").sdf)
    with pytest.raises(MeshError, match="'cube' has a field alone, and this needs its mesh"):
        Stage(read_recording(recording, object=alone))


def test_an_object_that_moves_away_from_the_origin_stays_in_sight(tmp_path):
    path = tmp_path / "far.mcap"
    hand, obj = load_hand("isyhand"), load_object("cube")
    T_wh = gtsam.Pose3(gtsam.Rot3.Rz(2.0), [5.0, -7.0, 3.0])
    with RecordingWriter(path, object_metadata(obj), hand_xml=hand.xml, mesh=mesh_file(obj)) as w:
        for t in (0.0, 1.0):
            w.joint_states(t, hand.joint_names, np.zeros(len(hand.joint_names)))
            w.tactile(t, hand.pad_names, np.zeros(16), np.zeros(16))
            w.hand_pose(t, T_wh)
            w.truth(t, T_wh * gtsam.Pose3(gtsam.Rot3(), [0.09, 0.056, 0.1]))
    sheet = contact_sheet(path, 1, SIZE)
    cube = like(sheet[: 2 * SIZE[1]], color_of("cube")).reshape(2, *SIZE[::-1])
    assert (cube.sum(axis=(1, 2)) > 150).all()


@needs_graphics
def test_estimates_are_drawn_in_their_colours(tmp_path, recording):
    out = tmp_path / "results"
    evaluate(recording.parent, ["vis"], "tuned", out)
    poses = {"vis": read_estimates(out, recording, "vis")}
    assert len(poses["vis"].poses) == SECONDS * 50 + 1
    plain = contact_sheet(recording, 1, SIZE)[: 2 * SIZE[1]]
    compared = contact_sheet(recording, 1, SIZE, poses)[: 2 * SIZE[1]]
    vermilion = np.array(rgb(OF_METHODS["vis"])) / 255
    assert like(compared, vermilion, 0.2).sum() > 60 > like(plain, vermilion, 0.2).sum()
    assert like(plain, color_of("cube")).sum() > 300 > like(compared, color_of("cube")).sum()
    with pytest.raises(RecordingError, match="has no method 'vis\\+tac'; it has vis"):
        read_estimates(out, recording, "vis+tac")
    with pytest.raises(RecordingError, match="holds no estimates of"):
        read_estimates(tmp_path, recording, "vis")


@needs_graphics
def test_a_method_may_have_another_name_and_keeps_its_colour(tmp_path, recording):
    evaluate(recording.parent, ["vis"], "tuned", tmp_path / "results")
    options = ["--estimates", tmp_path / "results", "--size", "160x120", "--instants", 1]
    for name, methods in (("a", "vis"), ("b", "what the tracker says=vis")):
        answer = call(recording, "--out", tmp_path / f"{name}.png", "--methods", methods, *options)
        assert answer.exit_code == 0, answer.output
    a, b = (np.asarray(Image.open(tmp_path / f"{name}.png")) for name in "ab")
    np.testing.assert_array_equal(a[: 2 * SIZE[1]], b[: 2 * SIZE[1]])
    assert (a[-LINE:] != b[-LINE:]).any()


@needs_graphics
def test_an_estimate_is_drawn_with_the_region_in_which_it_expects_the_centre(recording):
    times, T_wo = np.array([0.0, SECONDS]), gtsam.Pose3(gtsam.Rot3(), [0.09, 0.056, 0.1])
    areas = []
    for sigma in (1e-5, 0.02, 1.0, np.inf):  # [m]
        covariance = np.diag([1e-6] * 3 + [sigma**2] * 3)
        vis = Estimated("vis", PoseTrajectory(times, [T_wo, T_wo]), np.array([covariance] * 2))
        sheet = contact_sheet(recording, 1, SIZE, {"vis": vis})[: 2 * SIZE[1]]
        areas.append(like(sheet, np.array(rgb(OF_METHODS["vis"])) / 255, 0.3).sum())
    assert areas[1] > 2 * areas[0]
    assert areas[2] == areas[3]  # where nothing is known nothing is drawn
    assert abs(areas[2] - areas[0]) < 0.3 * areas[0]


@needs_graphics
@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_a_film_for_web_pages_has_all_its_pictures(recording, tmp_path, suffix):
    out = tmp_path / f"film{suffix}"
    options = ("--size", "160x120", "--fps", 5, "--speed", 2)
    answer = call(recording, "--out", out, *options)
    assert answer.exit_code == 0, answer.output
    with Image.open(out) as image:
        assert image.size == (2 * SIZE[0], SIZE[1] + LINE)
        assert image.n_frames == 6  # 2 s, twice as fast
        assert image.info["loop"] == 0
        pictures = []
        for k in range(6):
            image.seek(k)
            pictures.append(np.asarray(image.convert("RGB")).astype(int))
            assert image.info["duration"] == 200
    assert np.abs(pictures[0] - pictures[-1]).max() > 60
    assert np.abs(pictures[0] - contact_sheet_pair(recording)).mean() < 6


def contact_sheet_pair(recording):
    (first,) = list(film.frames(recording, 0.4, 1.0, SIZE))[:1]
    return first.astype(int)


@needs_graphics
def test_a_film_may_have_one_view_above_the_other(recording):
    (beside, *_), (above, *_) = (film.frames(recording, 0.4, 1.0, SIZE, s) for s in (False, True))
    width, height = SIZE
    assert above.shape == (2 * height + LINE, width, 3)
    np.testing.assert_array_equal(above[:height], beside[:height, :width])
    np.testing.assert_array_equal(above[height : 2 * height], beside[:height, width:])


@needs_graphics
def test_a_film_is_h264_that_every_player_shows(recording, tmp_path):
    imageio_ffmpeg = pytest.importorskip("imageio_ffmpeg")
    out = tmp_path / "film.mp4"
    answer = call(recording, "--out", out, "--size", "160x120", "--fps", 10)
    assert answer.exit_code == 0, answer.output
    assert f"wrote {out}, 0.0" in answer.output
    reader = imageio_ffmpeg.read_frames(str(out))
    about = next(reader)
    assert about["codec"] == "h264" and about["pix_fmt"].startswith("yuv420p")
    assert (about["size"], about["fps"]) == ((2 * SIZE[0], SIZE[1] + LINE), 10.0)
    pictures = [np.frombuffer(p, np.uint8).astype(int) for p in reader]
    assert len(pictures) == 21
    assert np.abs(pictures[0].reshape(136, 320, 3) - contact_sheet_pair(recording)).mean() < 6


@needs_graphics
def test_the_same_recording_gives_the_same_picture(recording, tmp_path):
    for name in "ab":
        answer = call(recording, "--out", tmp_path / f"{name}.png", "--size", "160x120")
        assert answer.exit_code == 0, answer.output
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize(
    ("out", "options", "words"),
    [
        ("film.avi", (), "expected a .mp4, .gif, .webp or .png file, got 'film.avi'"),
        ("film.gif", ("--size", "320"), "expected WIDTHxHEIGHT"),
        ("film.gif", ("--size", "0x10"), "32 to 4096"),
        ("film.gif", ("--fps", "0"), "--fps"),
    ],
)
def test_wrong_usage_has_exit_code_2(tmp_path, out, options, words):
    answer = call(tmp_path / "any.mcap", "--out", tmp_path / out, *options)
    assert answer.exit_code == 2
    assert words in " ".join(answer.output.replace("│", " ").split())


def test_without_graphics_the_packages_are_named(monkeypatch):
    monkeypatch.setattr(sim.graphics, "find_library", lambda name: None)
    with pytest.raises(sim.graphics.NoGraphics, match="apt-get install libegl1"):
        sim.graphics.check_graphics()


def test_without_an_encoder_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(encode.NoEncoder, match="pip install imageio-ffmpeg"):
        encode.encoder(".mp4")


def test_every_object_has_a_colour_and_keeps_it():
    assert color_of("banana") == color_of("011_banana")
    assert color_of("something else") == color_of("something else")
    assert all(0 <= c <= 1 for name in ("can", "teapot") for c in color_of(name))
