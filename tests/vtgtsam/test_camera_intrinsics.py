# SPDX-License-Identifier: MIT
import numpy as np
import pytest

from vtgtsam.camera import CameraIntrinsics

CAMERA = CameraIntrinsics(width=64, height=48, fx=60.0, fy=62.0, cx=30.5, cy=25.0)


def random_points(count=50, seed=0):
    rng = np.random.default_rng(seed)
    depth = rng.uniform(0.3, 1.0, count)
    return np.column_stack([rng.uniform(-0.2, 0.2, (count, 2)) * depth[:, None], depth])


def test_a_point_on_the_optical_axis_projects_to_the_principal_point():
    np.testing.assert_allclose(CAMERA.project([[0.0, 0.0, 0.7]]), [[30.5, 25.0]])


def test_x_is_to_the_right_and_y_is_down():
    (u, v), *_ = CAMERA.project([[0.1, 0.2, 1.0]])
    assert u == pytest.approx(30.5 + 6.0)
    assert v == pytest.approx(25.0 + 12.4)


def test_the_matrix_projects_as_project_does():
    points = random_points()
    homogeneous = points @ CAMERA.matrix.T
    np.testing.assert_allclose(CAMERA.project(points), homogeneous[:, :2] / homogeneous[:, 2:])


def test_rays_go_through_the_centres_of_their_pixels():
    rays = CAMERA.rays()
    assert rays.shape == (48, 64, 3)
    pixels = CAMERA.project(rays.reshape(-1, 3))
    v, u = np.divmod(np.arange(48 * 64), 64)
    np.testing.assert_allclose(pixels, np.column_stack([u, v]), atol=1e-9)


def test_back_projection_is_the_inverse_of_projection():
    depth = np.zeros((48, 64))
    depth[10, 20], depth[40, 3] = 0.5, 0.8
    points = CAMERA.back_project(depth)
    np.testing.assert_allclose(points[:, 2], [0.5, 0.8])
    np.testing.assert_allclose(CAMERA.project(points), [[20, 10], [3, 40]])


@pytest.mark.parametrize("nothing", [0.0, np.nan, np.inf, -1.0])
def test_pixels_without_depth_give_no_point(nothing):
    depth = np.full((48, 64), nothing)
    depth[5, 6] = 0.4
    assert len(CAMERA.back_project(depth)) == 1


def test_a_crop_sees_the_same_points_at_shifted_pixels():
    points = random_points()
    crop = CAMERA.cropped(left=7, top=3, width=20, height=30)
    assert (crop.width, crop.height) == (20, 30)
    np.testing.assert_allclose(crop.project(points), CAMERA.project(points) - [7, 3])


def test_every_other_pixel_is_the_strided_camera():
    rays = CAMERA.rays()[::3, ::3]
    strided = CAMERA.strided(3)
    np.testing.assert_allclose(strided.rays(), rays, atol=1e-12)


def test_half_the_resolution_keeps_the_field_of_view():
    half = CAMERA.scaled(0.5)
    assert (half.width, half.height) == (32, 24)
    # The mean ray of a 2 x 2 block is the ray of the pixel that replaces it.
    blocks = CAMERA.rays().reshape(24, 2, 32, 2, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(half.rays(), blocks, atol=1e-12)


def test_a_wrong_size_is_refused_with_both_sizes():
    with pytest.raises(ValueError, match=r"\(48, 64\), got \(64, 48\)"):
        CAMERA.back_project(np.ones((64, 48)))


def test_millimetres_are_refused():
    with pytest.raises(ValueError, match="divide a 16 bit image of millimetres by 1000"):
        CAMERA.back_project(np.full((48, 64), 830.0))


@pytest.mark.parametrize("changed", [{"width": 0}, {"fx": 0.0}, {"fy": np.nan}, {"cx": np.inf}])
def test_impossible_intrinsics_are_refused(changed):
    numbers = {"width": 64, "height": 48, "fx": 60.0, "fy": 62.0, "cx": 30.5, "cy": 25.0}
    with pytest.raises(ValueError):
        CameraIntrinsics(**{**numbers, **changed})
