# SPDX-License-Identifier: MIT
import gtsam
import mujoco
import numpy as np
import pytest
from graphics_needed import needs_graphics
from PIL import Image
from short_course import FRAMES, shorten
from typer.testing import CliRunner

import sim.graphics
from sim import sequence
from sim.__main__ import app
from sim.camera import DepthCamera
from sim.color import SIGMA, ColorCamera, add_color_noise
from sim.hands import load_description
from sim.scene import build
from sim.sequence import SequenceName, Settings, make_sequence
from sim.skin import find_skin
from vtgtsam import load_object
from vtgtsam.camera import CameraIntrinsics
from vtgtsam.recording.camera import color_images, depth_images

T_WC = gtsam.Pose3(gtsam.Rot3.RzRyRx(2.5, 0.2, -0.4), [0.3, -0.1, 0.8])
# A window that lies beside the principal point.
WINDOW = CameraIntrinsics(640, 480, 615.0, 615.0, 319.5, 239.5).cropped(330, 150, 210, 150)


def glowing_box():
    """A box 0.7 m in front of the camera, right of the middle, that needs no light."""
    spec = mujoco.MjSpec()
    spec.visual.headlight.active = 0
    spec.add_material(name="glow", rgba=(1, 0, 0, 1), emission=1.0)
    T = T_WC * gtsam.Pose3(gtsam.Rot3.RzRyRx(0.5, 0.3, 0.2), [0.11, -0.02, 0.7])
    body = spec.worldbody.add_body(
        pos=T.translation(), quat=T.rotation().toQuaternion().coeffs()[[3, 0, 1, 2]]
    )
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=(0.03, 0.05, 0.04), material="glow")
    return spec.compile()


@needs_graphics
def test_colour_and_depth_images_show_the_same_pixels():
    model = glowing_box()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    depth, _ = DepthCamera(model, WINDOW).render(data, T_WC)
    with ColorCamera(model, WINDOW) as camera:
        image = camera.render(data, T_WC).astype(int)
    assert image.shape == (150, 210, 3)
    red = image[..., 0] > 127
    assert red.sum() > 3000
    # Rounding along the outline; a quarter of a pixel to a side gives 45 and more, a half 115.
    assert (red != (depth > 0)).sum() < 40
    assert image[red][:, 1:].max() == 0


def test_pixels_that_are_not_square_are_refused():
    with pytest.raises(ValueError, match="pixels must be square"):
        ColorCamera(None, CameraIntrinsics(4, 4, 10.0, 11.0, 2.0, 2.0))


OBJ = """mtllib plate.mtl
usemtl paint
v -40 -30 0
v 40 -30 0
v 40 30 0
v -40 30 0
v 0 0 -20
vt 0 0
vt 1 0
vt 1 1
vt 0 1
f 1/1 2/2 3/3
f 1/1 3/3 4/4
f 2/2 1/1 5/1
f 3/2 2/1 5/1
f 4/2 3/1 5/1
f 1/2 4/1 5/1
"""


@pytest.fixture
def plate(tmp_path):
    """A pyramid in millimetres whose base has a picture: upper half green, lower left red, else blue."""
    (tmp_path / "plate.obj").write_text(OBJ)
    (tmp_path / "plate.mtl").write_text("newmtl paint\nmap_Kd plate.png\n")
    picture = np.zeros((64, 64, 3), np.uint8)
    picture[:32] = 0, 200, 0
    picture[32:, :32] = 200, 0, 0
    picture[32:, 32:] = 0, 0, 200
    Image.fromarray(picture).save(tmp_path / "plate.png")
    return load_object(tmp_path / "plate.obj", scale=0.001, origin=(0.0, 0.0, -0.01))


def test_the_texture_of_a_mesh_is_found_in_the_object_frame(plate):
    skin = find_skin(plate)
    corner = np.argmin(skin.vertices @ (1.0, 1.0, -1.0))  # lower left one of the base
    np.testing.assert_allclose(skin.vertices[corner], (-0.04, -0.03, 0.01), atol=1e-9)
    np.testing.assert_allclose(skin.coordinates[corner], (0.0, 1.0))
    assert skin.image.shape == (64, 64, 3)
    assert find_skin(load_object("mug")) is None


@needs_graphics
def test_a_texture_is_drawn_the_right_way_up(plate):
    description = load_description()
    model = build(description, description.load_hand(), plate)
    data = mujoco.MjData(model)
    data.qpos[model.joint("object").qposadr[0] + 2] = 1.0  # far above the hand
    mujoco.mj_forward(model, data)
    above = gtsam.Pose3(gtsam.Rot3(np.diag([1.0, -1.0, -1.0])), [0.0, 0.0, 1.31])
    with ColorCamera(model, CameraIntrinsics(100, 100, 300.0, 300.0, 49.5, 49.5)) as camera:
        image = camera.render(data, above).astype(int)
    seen = {
        (x, y): int(np.argmax(image[50 - 20 * y, 50 + 25 * x])) for x in (-1, 1) for y in (-1, 1)
    }
    assert seen == {(-1, 1): 1, (1, 1): 1, (-1, -1): 0, (1, -1): 2}


def test_noise_has_the_papers_sigma_and_stays_in_range():
    image = np.full((200, 200, 3), 128, np.uint8)
    image[0] = 255
    noisy = add_color_noise(image, np.random.default_rng(0), 2.0)
    assert noisy.dtype == np.uint8 and noisy[0].max() == 255
    assert noisy[1:].std() == pytest.approx(2 * SIGMA, rel=0.02)
    assert SIGMA**2 == pytest.approx(2.6)
    np.testing.assert_array_equal(add_color_noise(image, np.random.default_rng(0), 0.0), image)


@needs_graphics
def test_recordings_have_a_colour_image_for_each_depth_image_and_the_same_bytes(
    tmp_path, monkeypatch
):
    shorten(monkeypatch)
    sequence._world.cache_clear()
    settings, name = Settings(dataset="vary", images=True), SequenceName("gelatin_box", 0)
    files = {scale: tmp_path / f"{scale}.mcap" for scale in (0.0, 4.0)}
    make_sequence(settings, name, files)
    clean, noisy = ([image for _, image in color_images(path)] for path in files.values())
    depths = list(depth_images(files[0.0]))
    assert [t for t, _ in color_images(files[0.0])] == [t for t, _ in depths]
    assert len(clean) == FRAMES
    assert clean[0].shape[:2] == depths[0][1].shape
    difference = (noisy[0].astype(float) - clean[0]).std()
    assert 2.0 < difference < 4 * SIGMA  # JPEG takes some of it away
    background = depths[0][1] == 0
    assert clean[0][background].std() < clean[0][~background].std() / 2
    make_sequence(settings, name, {4.0: tmp_path / "again.mcap"})
    assert (tmp_path / "again.mcap").read_bytes() == files[4.0].read_bytes()


def test_without_graphics_images_are_refused_before_anything_is_made(tmp_path, monkeypatch):
    monkeypatch.setattr(sim.graphics, "find_library", lambda name: None)
    arguments = ["generate", "--dataset", "vary", "--out", str(tmp_path), "--images"]
    answer = CliRunner().invoke(app, arguments)
    assert isinstance(answer.exception, sim.graphics.NoGraphics)
    assert "libegl1" in str(answer.exception)
    assert not list(tmp_path.iterdir())
