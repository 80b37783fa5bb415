# SPDX-License-Identifier: MIT
import numpy as np
import pytest

from vtgtsam.camera import CameraIntrinsics
from vtgtsam.exceptions import RecordingError
from vtgtsam.recording import RecordingWriter
from vtgtsam.recording.camera import camera_intrinsics, color_images, depth_images


def test_depth_comes_back_to_half_a_millimetre_with_zero_where_there_is_none(tmp_path):
    depth = np.random.default_rng(0).uniform(0.2, 65.0, (48, 64))
    depth[0, :5] = [0.0, np.nan, np.inf, -1.0, 70.0]
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        writer.depth(1.25, depth)
        writer.depth(1.5, depth / 2)
    (first, found), (second, _) = depth_images(tmp_path / "a.mcap")
    assert (first, second) == (1.25, 1.5)
    assert (found[0, :5] == 0).all()
    np.testing.assert_allclose(found.ravel()[5:], depth.ravel()[5:], atol=0.00051)


def test_a_depth_image_is_a_16_bit_png_of_millimetres(tmp_path):
    import io

    from PIL import Image

    from vtgtsam.recording.images import encode_depth

    image = Image.open(io.BytesIO(encode_depth(np.array([[0.6, 1.2345]]))))
    assert (image.format, image.mode) == ("PNG", "I;16")
    assert np.asarray(image).tolist() == [[600, 1234]]


def test_colour_comes_back_in_the_right_order(tmp_path):
    image = np.zeros((32, 32, 3), np.uint8)
    image[..., 0], image[..., 1] = 250, 100
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        writer.color(0.5, image)
    ((time, found),) = color_images(tmp_path / "a.mcap")
    assert time == 0.5
    np.testing.assert_allclose(found, image, atol=4)  # JPEG loses a little


def test_intrinsics_come_back_and_are_none_where_there_are_none(tmp_path):
    intrinsics = CameraIntrinsics(640, 480, 610.5, 611.5, 320.25, 239.75)
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        writer.camera_info(0.0, intrinsics)
    assert camera_intrinsics(tmp_path / "a.mcap") == intrinsics
    with RecordingWriter(tmp_path / "b.mcap"):
        pass
    assert camera_intrinsics(tmp_path / "b.mcap") is None


def test_an_image_that_is_none_is_refused(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        writer._write_image("/camera/depth", 0.0, "png", b"nonsense", None)
    with pytest.raises(RecordingError, match=r"image on /camera/depth at 0\.000 s cannot be read"):
        list(depth_images(tmp_path / "a.mcap"))
