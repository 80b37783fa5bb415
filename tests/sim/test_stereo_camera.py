# SPDX-License-Identifier: MIT
"""The stereo camera on planes, next to published figures, and what its images show beside edges."""

import gtsam
import mujoco
import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from sim.camera import MAX_RANGE
from sim.stereo import kernels, rig
from sim.stereo.aligned import aligned
from sim.stereo.infrared import InfraredCamera
from sim.stereo.matching import Matcher, depth_of
from sim.stereo.pattern import DOTS, FIELD, RESOLUTION, pattern
from sim.stereo.video import BORDER, exposed, surrounding
from vtgtsam.camera import CameraIntrinsics

LOOKING_DOWN = gtsam.Rot3(np.diag([1.0, -1.0, -1.0]))
PART = rig.INFRARED.cropped(300, 160, 260, 150)
USABLE = (slice(12, -12), slice(rig.DISPARITIES + 12, -12))


def measured(geoms, height, images=1, scale=1.0):
    """Depth images [m] of a camera that looks down on geoms from a height."""
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{geoms}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    T_wc = gtsam.Pose3(LOOKING_DOWN, np.array([0.013, 0.021, height]))
    pair = [InfraredCamera(model, PART, x).render(data, T_wc) for x in (0.0, rig.BASELINE)]
    rng, matcher = np.random.default_rng(0), Matcher()
    found = [matcher.disparity(*exposed(np.stack(pair), rng, scale)) for _ in range(images)]
    return np.array([depth_of(d, PART.fx, MAX_RANGE) for d in found])


PLANE = '<geom type="box" size="3 3 0.01" pos="0 0 -0.01" rgba="0.7 0.7 0.7 1"/>'


def correlation_length(error, axis):
    """Distance [pixels] at which an image's errors have fallen to 1/e of their correlation."""
    error = error - error.mean()
    for lag in range(1, 20):
        a, b = np.moveaxis(error, axis, 0)[:-lag], np.moveaxis(error, axis, 0)[lag:]
        if (a * b).mean() < error.var() / np.e:
            return lag
    return 20


# The subpixel noise that Intel says to expect is 0.08 pixels (librealsense, issue 3904: 0.03 on the best texture).
@pytest.mark.parametrize(
    ("height", "least", "most"), [(0.4, 0.015, 0.08), (0.6, 0.04, 0.12), (0.8, 0.06, 0.16)]
)
def test_noise_on_a_plane_is_that_published_of_the_real_camera(height, least, most):
    depth = measured(PLANE, height, images=4)[(slice(None), *USABLE)]
    assert (depth > 0.0).mean() > 0.995
    error = depth - height
    in_pixels = error[0].std() * PART.fx * rig.BASELINE / height**2
    assert least < in_pixels < most
    assert abs(np.median(error[0])) < 0.002
    # Errors of patches, of which much stays in the image: unlike the paper's, averaging does not cure them.
    assert all(3 <= correlation_length(error[0], axis) <= 10 for axis in (0, 1))
    assert error.mean(axis=0).std() > 0.4 * error[0].std()


def test_without_noise_the_same_scene_gives_the_same_image():
    np.testing.assert_array_equal(*measured(PLANE, 0.6, images=2, scale=0.0))


def test_depth_is_quantised_as_the_d400_does():
    depth = measured(PLANE, 0.6)[0]
    disparity = PART.fx * rig.BASELINE / depth[depth > 0.0]
    np.testing.assert_allclose(disparity * 32, np.round(disparity * 32), atol=1e-6)


def test_a_silhouette_is_fattened_and_has_a_shadow_on_its_left():
    table = '<geom type="box" size="3 3 0.01" pos="0 0 -0.31" rgba="0.7 0.7 0.7 1"/>'
    post = '<geom type="box" size="0.02 0.1 0.01" pos="0.03 0.02 -0.01" rgba="0.7 0.7 0.7 1"/>'
    depth = measured(table + post, 0.6)[0][60:90]
    T_wc = gtsam.Pose3(LOOKING_DOWN, np.array([0.013, 0.021, 0.6]))
    sides_w = np.array([[0.01, 0.02, 0.0], [0.05, 0.02, 0.0]])
    left, right = PART.project(T_wc.transformTo(sides_w.T).T)[:, 0]
    near = (depth > 0.55) & (depth < 0.65)
    wide = near.sum(axis=1).mean()
    assert 0.5 < wide - (right - left) < 10.0
    columns = np.arange(PART.width)
    beside = (columns < left - 6) & (columns > left - 18)
    other = (columns > right + 6) & (columns < right + 18)
    assert (depth[:, beside] == 0.0).mean() > (depth[:, other] == 0.0).mean() + 0.1
    assert np.median(depth[:, other][depth[:, other] > 0]) == pytest.approx(0.9, abs=0.03)


def test_the_projector_has_about_5000_dots_in_its_field():
    image = pattern()
    width, height = 2 * np.tan(FIELD / 2) * RESOLUTION
    assert image.shape == (round(height), round(width))
    a_dot = image.sum() / DOTS
    assert a_dot == pytest.approx(2 * np.pi * (0.0019 * RESOLUTION) ** 2, rel=0.05)


def test_a_point_that_the_projector_does_not_see_gets_no_dots():
    low = '<geom type="box" size="3 3 0.01" pos="0 0 -0.31" rgba="0.7 0.7 0.7 1"/>'
    roof = '<geom type="box" size="0.05 0.2 0.005" pos="0.041 0.02 0" rgba="0.7 0.7 0.7 1"/>'
    images = []
    for geoms in (low, low + roof):
        model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{geoms}</worldbody></mujoco>")
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        T_wc = gtsam.Pose3(LOOKING_DOWN, np.array([0.013, 0.021, 0.3]))
        images.append(InfraredCamera(model, rig.INFRARED, 0.0).render(data, T_wc))
    changed = images[1] / images[0]
    # Beside the roof, as the left imager sees it, lies the ground that the roof hides from the projector.
    floor = images[0] > 2 * np.median(images[0])
    shadow = floor & (changed < 0.6)
    columns = np.nonzero(shadow)[1]
    assert len(columns) > 50


def test_the_grain_moves_with_its_body_and_is_linear_between_nodes():
    rng = np.random.default_rng(0)
    table = rng.standard_normal((8, 8, 8)).astype(np.float32)
    R_wb = np.array([np.eye(3), gtsam.Rot3.Ypr(0.4, -1.0, 2.0).matrix()])
    t_wb = np.array([[0.0, 0.0, 0.0], [0.3, -0.2, 0.1]])
    points_b = rng.uniform(-0.1, 0.1, (500, 3))
    expected = map_coordinates(
        table.astype(np.float64), points_b.T / 0.004, order=1, mode="grid-wrap"
    )
    body = np.array([0, 1], dtype=np.int32)  # of geoms 0 and 1
    for geom, b in ((-1, 0), (0, 0), (1, 1)):
        noise, points_w = np.empty(500), points_b @ R_wb[b].T + t_wb[b]
        geoms = np.full(500, geom, dtype=np.int32)
        kernels.grain(points_w, geoms, body, R_wb, t_wb, table, 0.004, noise)
        np.testing.assert_allclose(noise, expected, atol=1e-9)  # rounding of the pose


def test_the_part_that_is_matched_reaches_as_far_to_the_left_as_disparities_do():
    part = rig.INFRARED.cropped(300, 100, 120, 90)
    matched, inner = surrounding(part)
    assert matched.width == 120 + rig.DISPARITIES + 2 * BORDER and matched.height == 90 + 2 * BORDER
    assert inner == (
        slice(BORDER, BORDER + 90),
        slice(rig.DISPARITIES + BORDER, rig.DISPARITIES + BORDER + 120),
    )
    at_the_edge, inner = surrounding(rig.INFRARED.cropped(20, 0, 50, 40))
    assert at_the_edge.cx == rig.INFRARED.cx and inner == (slice(0, 40), slice(20, 70))


def test_alignment_puts_each_pixel_where_the_other_camera_sees_it():
    depth = np.zeros((40, 50))
    depth[10:30, 10:40] = 0.8
    depth[15:25, 20:30] = 0.5  # before the rest
    camera = CameraIntrinsics(50, 40, 100.0, 100.0, 24.5, 19.5)
    other = CameraIntrinsics(80, 60, 145.0, 145.0, 39.5, 29.5)
    T_dc = gtsam.Pose3(gtsam.Rot3(), np.array([-0.015, 0.0, 0.0]))
    image = aligned(depth, camera, other, T_dc)
    points_d = camera.back_project(depth)
    pixels = np.round(other.project(T_dc.transformTo(points_d.T).T)).astype(int)
    assert set(np.unique(image)) == {0.0, 0.5, 0.8}
    near = points_d[:, 2] == 0.5
    assert (image[pixels[near, 1], pixels[near, 0]] == 0.5).all()
    # No holes between neighbours, though the other image has more pixels.
    rows, columns = np.nonzero(image == 0.5)
    assert len(rows) == (np.ptp(rows) + 1) * (np.ptp(columns) + 1)
    shift = columns.mean() - (24.5 - camera.cx) * 1.45 - other.cx
    assert shift == pytest.approx(0.015 / 0.5 * 145.0, abs=0.6)


def test_alignment_to_the_same_camera_changes_nothing():
    rng = np.random.default_rng(0)
    depth = rng.uniform(0.5, 1.0, (30, 40)) * (rng.random((30, 40)) < 0.8)
    camera = CameraIntrinsics(40, 30, 100.0, 100.0, 19.5, 14.5)
    np.testing.assert_allclose(aligned(depth, camera, camera, gtsam.Pose3()), depth)
