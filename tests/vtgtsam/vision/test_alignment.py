# SPDX-License-Identifier: MIT
"""One image and one pose: what is predicted, what the pixels say, and the step that follows."""

import gtsam
import numpy as np
import pytest
import trimesh
from scipy.ndimage import binary_dilation, binary_erosion, laplace

from vtgtsam.camera import CameraIntrinsics
from vtgtsam.sdf.build import build_sdf
from vtgtsam.vision import kernels, ray_kernels
from vtgtsam.vision.alignment import CUTOFF, GRAZING, ROOM, STEP_SIGMA, Evidence, Shape, align
from vtgtsam.vision.view import MIN_SIGMA, View, crop, noise_of

CAMERA = CameraIntrinsics(width=120, height=100, fx=300.0, fy=310.0, cx=60.3, cy=49.1)
RADIUS = 0.04
FAR = 1.5  # [m], the wall behind the object
BOX = np.array([0.05, 0.08, 0.03])
T_CO = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.4, -0.7, 0.2), np.array([0.01, -0.015, 0.6]))


@pytest.fixture(scope="module")
def ball():
    return Shape(build_sdf(trimesh.creation.icosphere(4, RADIUS), resolution=96))


@pytest.fixture(scope="module")
def plate():
    mesh = trimesh.creation.box((0.09, 0.08, 0.0005))  # half as thick as a cell of its field
    return Shape(build_sdf(mesh, resolution=96))


@pytest.fixture(scope="module")
def box():
    mesh = trimesh.creation.box(BOX)
    mesh.apply_translation((0.1, 0.0, 0.0))  # the object's frame is not at its centre
    return Shape(build_sdf(mesh, resolution=96))


def ball_depth(center_c):
    """Exact depth image of a ball before a wall, by geometry alone."""
    rays = CAMERA.rays()
    along = rays @ center_c / (rays**2).sum(axis=-1)
    gap = center_c @ center_c - along**2 * (rays**2).sum(
        axis=-1
    )  # squared distance of ray and centre
    inside = RADIUS**2 - gap
    front = along - np.sqrt(np.maximum(inside, 0.0) / (rays**2).sum(axis=-1))
    return np.where(inside > 0.0, front, FAR)


def box_depth(T_co):
    """Exact depth image of the box before a wall: the slab method, written independently."""
    T_oc = T_co.inverse()
    origin = T_oc.translation() - [0.1, 0.0, 0.0]
    rays = CAMERA.rays() @ T_oc.rotation().matrix().T
    planes = (np.array([-BOX / 2, BOX / 2])[:, None, None] - origin) / rays
    enter, leave = planes.min(axis=0).max(axis=-1), planes.max(axis=0).min(axis=-1)
    return np.where(enter < leave, enter, FAR)


def view_of(depth, sigma=0.004):
    return View(depth, np.zeros(depth.shape, dtype=bool), CAMERA, sigma)


def predicted(shape, T_co):
    depth = np.empty((CAMERA.height, CAMERA.width))
    T_oc = T_co.inverse()
    camera = np.array([CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy])
    R_oc, t_oc = T_oc.rotation().matrix(), T_oc.translation()
    ray_kernels.render(*shape.grid, shape.box, camera, R_oc, t_oc, depth)
    return depth


@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.05, -0.04), (-0.11, 0.09)])
def test_the_predicted_depth_of_a_ball_is_that_of_geometry(ball, offset):
    center_c = np.array([*offset, 0.5])
    image = predicted(ball, gtsam.Pose3(gtsam.Rot3.RzRyRx(1.0, 0.3, 2.0), center_c))
    expected = ball_depth(center_c)
    seen = image < np.inf
    frontal = (
        center_c[2] - expected > RADIUS / 2
    )  # towards the rim a fifth of a cell is 1 mm of depth
    both = seen & (expected < FAR) & frontal
    assert both.sum() > 0.4 * (expected < FAR).sum()  # in a corner less of it is frontal
    np.testing.assert_allclose(image[both], expected[both], atol=3e-4)  # a third of a cell
    # One ring of pixels may fall to either side.
    assert (seen != (expected < FAR)).sum() < np.sqrt((expected < FAR).sum())


def test_the_predicted_depth_of_a_box_is_that_of_geometry(box):
    image, expected = predicted(box, T_CO), box_depth(T_CO)
    seen = image < np.inf
    both = seen & (expected < FAR)
    assert both.sum() > 800
    error = np.abs(image - expected)[both]
    assert np.percentile(error, 90) < 3e-4  # a third of a cell; edges are rounded by the grid
    assert (seen != (expected < FAR)).sum() < 3 * np.sqrt(both.sum())


def test_the_right_pose_is_seen_in_full_without_contradiction(box):
    seen = Evidence(box, view_of(box_depth(T_CO)), T_CO)
    assert seen.visible_fraction > 0.97
    assert seen.contradiction < 0.01
    assert seen.misfit < 0.5  # no noise


def test_what_covers_the_object_says_nothing_and_what_lies_behind_speaks_against_it(box):
    depth = box_depth(T_CO)
    body = depth < FAR
    columns = np.arange(CAMERA.width) - np.median(np.nonzero(body)[1])
    covered, gone = columns < -8, columns > 8
    depth[:, covered] -= np.where(body[:, covered], 0.03, 0.0)
    depth[:, gone] = FAR
    kind = Evidence(box, view_of(depth), T_CO).kind
    inside = binary_erosion(body, iterations=2)
    assert min((inside & covered).sum(), (inside & gone).sum()) > 100
    assert (kind[inside & covered] == kernels.COVERED).all()
    assert (kind[inside & gone] == kernels.THROUGH).all()
    # A window that reaches over to the neighbours leaves out those that are decided.
    assert (kind[inside & (abs(columns) < 8)] == kernels.SURFACE).all()
    assert (kind[~binary_dilation(body)] == kernels.NOTHING).all()


def test_a_flat_hand_just_above_the_surface_is_told_from_it_by_its_neighbours(box):
    # 7 mm before the surface is less than two sigma of a pixel, but 25 pixels side by side are.
    rng = np.random.default_rng(0)
    depth = box_depth(T_CO)
    body = depth < FAR
    depth[45:] = np.where(body[45:], depth[45:] - 0.007, depth[45:])
    kind = Evidence(box, view_of(depth + rng.normal(0.0, 0.004, depth.shape)), T_CO).kind
    assert (kind[49:][body[49:]] == kernels.COVERED).mean() > 0.9
    assert (kind[:41][body[:41]] == kernels.SURFACE).mean() > 0.9


def test_pixels_of_the_hand_are_no_surface_but_can_be_seen_through(box):
    depth = box_depth(T_CO)
    body = depth < FAR
    depth[:30] = FAR
    hand = np.ones(depth.shape, dtype=bool)
    kind = Evidence(box, View(depth, hand, CAMERA, 0.004), T_CO).kind
    assert (kind == kernels.SURFACE).sum() == 0
    assert (kind[:30][body[:30]] == kernels.THROUGH).mean() > 0.95


def beside_a_hand(depth, hand_depth, sigma=0.004):
    """A view of an object and of a hand whose own depth is known, and which covers nothing where it is inf."""
    return View(depth, depth >= hand_depth - 0.01, CAMERA, sigma, hand_depth)


def test_what_is_nearer_and_cannot_be_the_hand_is_the_object(box):
    depth = box_depth(T_CO)
    body = depth < FAR
    hand_depth = np.full(depth.shape, np.inf)
    middle = int(np.median(np.nonzero(body)[1]))
    hand_depth[:, :middle] = depth[:, :middle] = (
        0.3  # a finger before the left half; its depth spreads
    )
    away = 0.015 * T_CO.translation() / np.linalg.norm(T_CO.translation())
    behind = gtsam.Pose3(T_CO.rotation(), T_CO.translation() + away)
    kind = Evidence(box, beside_a_hand(depth, hand_depth), behind).kind
    inside = binary_erosion(body, iterations=4)
    columns = np.arange(CAMERA.width) - middle
    spread, clear = inside & (columns < kernels.CLEAR), inside & (columns >= kernels.CLEAR)
    assert min(spread.sum(), clear.sum()) > 50
    assert (kind[spread] == kernels.COVERED).all()
    assert (kind[clear] == kernels.NEARER).all()
    # Of a hand that is not known, any of it might be that.
    assert (Evidence(box, view_of(depth), behind).kind != kernels.NEARER).all()


def test_the_gradient_of_what_is_nearer_is_that_of_its_distance_by_finite_differences(ball):
    # Each pixel's Huber loss: sigma (phi - sigma / 2) / sigma^2, with phi = |s| - radius of the measured point s.
    sigma, center_c = 0.001, np.array([0.02, -0.01, 0.5])
    depth = ball_depth(center_c)
    away = 0.012 * center_c / np.linalg.norm(center_c)
    T_co = gtsam.Pose3(gtsam.Rot3(), center_c + away)
    beside = np.full(depth.shape, np.inf)
    beside[0, 0] = 0.6  # a known hand, elsewhere
    seen = Evidence(ball, beside_a_hand(depth, beside, sigma), T_co)
    used = seen.kind == kernels.NEARER
    assert used.sum() > 500
    points_c = (CAMERA.rays() * depth[..., None])[used]

    def loss(T):
        phi = np.linalg.norm(points_c - T.translation(), axis=1) - RADIUS
        used_phi = phi[(phi > 0.0) & (phi < kernels.REACH)]
        return ((used_phi - sigma / 2) / sigma).sum()

    depth[~used] = 0.0
    _, gradient = Evidence(ball, beside_a_hand(depth, beside, sigma), T_co).normal_equations()
    h = 1e-6
    expected = [
        (loss(T_co.retract(h * e)) - loss(T_co.retract(-h * e))) / (2 * h) for e in np.eye(6)[3:]
    ]
    np.testing.assert_allclose(
        gradient[3:], expected, rtol=0.02, atol=0.02 * np.abs(expected).max()
    )


def test_an_object_far_nearer_than_thought_is_found_where_the_hand_is_known(box):
    # 25 mm off no pixel is the surface any more: without the hand all of it could be a hand's.
    away = 0.025 * T_CO.translation() / np.linalg.norm(T_CO.translation())
    start = gtsam.Pose3(T_CO.rotation(), T_CO.translation() + away)
    depth = box_depth(T_CO)
    hand_depth = np.full(depth.shape, np.inf)
    hand_depth[0, 0] = 0.6
    known = align(box, beside_a_hand(depth, hand_depth), start, iterations=15)
    unknown = align(box, view_of(depth), start, iterations=15)
    left = [np.linalg.norm(T.translation() - T_CO.translation()) for T in (known, unknown)]
    assert left[0] < 0.002
    assert left[1] > 0.02


def test_normal_equations_are_those_of_the_plane_distances_by_finite_differences(box):
    # e = (z - d) g . r on the box's flat faces, with d and g . r by geometry, weights as documented.
    xi = np.array([0.004, -0.006, 0.005, 0.001, -0.0005, 0.0005])
    T_co, sigma = T_CO.retract(xi), 0.004
    predicted_at = box_depth(T_co)
    body = binary_erosion((predicted_at < FAR) & (box_depth(T_CO) < FAR), iterations=2)
    face = np.abs(laplace(predicted_at)) < 1e-4  # not at the edges between faces
    flat = body & binary_erosion(face, iterations=2)
    assert flat.sum() > 400
    depth = np.where(flat, box_depth(T_CO), 0.0)
    seen = Evidence(box, view_of(depth, sigma), T_co)
    used = seen.kind == kernels.SURFACE
    assert used.sum() > 0.98 * flat.sum() and not (seen.kind == kernels.THROUGH).any()
    h = 1e-6
    slope = -plane_slopes(T_co)[used]
    difference = (depth - predicted_at)[used]
    jacobian = np.column_stack(
        [
            -slope
            * (box_depth(T_co.retract(h * e)) - box_depth(T_co.retract(-h * e)))[used]
            / (2 * h)
            for e in np.eye(6)
        ]
    )
    cutoff = CUTOFF * sigma + ROOM
    weight = (1 - (difference / cutoff) ** 2) ** 2 / (sigma**2 * (slope**2 + GRAZING**2))
    information, gradient = seen.normal_equations()
    expected = jacobian.T @ (weight[:, None] * jacobian)
    scale = np.sqrt(
        np.diag(expected) + 1.0
    )  # a direction along all faces in sight has no information
    np.testing.assert_allclose(
        information / np.outer(scale, scale), expected / np.outer(scale, scale), atol=1e-6
    )
    expected = jacobian.T @ (weight * difference * slope)
    np.testing.assert_allclose(gradient / scale, expected / scale, atol=1e-5)
    assert np.abs(expected / scale).max() > 1.0


def plane_slopes(T_co):
    """How far a ray comes nearer to the plane of the face it meets, per unit of depth; positive."""
    T_oc = T_co.inverse()
    rays = CAMERA.rays() @ T_oc.rotation().matrix().T
    planes = (
        np.array([-BOX / 2, BOX / 2])[:, None, None] - T_oc.translation() + [0.1, 0, 0]
    ) / rays
    axis = planes.min(axis=0).argmax(axis=-1)
    return np.abs(np.take_along_axis(rays, axis[..., None], axis=-1)[..., 0])


def test_the_gradient_is_that_of_the_squared_plane_distances(ball):
    # A ball 1.5 mm too far away: to first order, each pixel's plane distance is 1.5 mm times the slope.
    center_c = np.array([0.02, -0.01, 0.5])
    away = 0.0015 * center_c / np.linalg.norm(center_c)
    view = view_of(ball_depth(center_c))
    seen = Evidence(ball, view, gtsam.Pose3(gtsam.Rot3(), center_c + away))
    information, gradient = seen.normal_equations()
    step = -np.linalg.solve(information + 1e-3 * ball.prior, gradient)
    np.testing.assert_allclose(step[3:], -away, atol=2e-4)
    np.testing.assert_allclose(step[:3], 0.0, atol=5e-3)


def test_information_is_what_the_numbers_of_pixels_say(ball):
    # Each pixel of a frontal surface counts about 1 / sigma^2 along the optical axis.
    center_c = np.array([0.0, 0.0, 0.5])
    seen = Evidence(ball, view_of(ball_depth(center_c)), gtsam.Pose3(gtsam.Rot3(), center_c))
    information, _ = seen.normal_equations()
    expected = seen.surface / 0.004**2
    assert 0.3 * expected < information[5, 5] < 0.9 * expected  # half of the ball is seen obliquely


def test_what_errors_of_the_normals_feign_is_not_credible(ball):
    # The grid's normals are not a ball's to the last degree, so that pixels seem to tell how it is turned.
    center_c = np.array([0.0, 0.0, 0.5])
    seen = Evidence(ball, view_of(ball_depth(center_c)), gtsam.Pose3(gtsam.Rot3(), center_c))
    information, _ = seen.normal_equations()
    credible = seen.credible()
    assert np.diag(information)[:3].min() > 0.0
    assert (np.diag(credible)[:3] < 0.01 * np.diag(information)[:3]).all()
    np.testing.assert_allclose(np.diag(credible)[3:], np.diag(information)[3:], rtol=0.1)


def test_what_a_box_shows_is_credible(box):
    seen = Evidence(box, view_of(box_depth(T_CO)), T_CO)
    information, _ = seen.normal_equations()
    to_center = np.linalg.inv(box.to_center())
    shown, believed = (to_center.T @ L @ to_center for L in (information, seen.credible()))
    np.testing.assert_allclose(np.diag(believed), np.diag(shown), rtol=0.25)
    assert np.linalg.eigvalsh(shown - believed).min() > -1e-6 * np.trace(shown)


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_disturbed_pose_comes_back(box, axis, sign):
    xi = np.zeros(6)
    xi[axis] = sign * (0.06 if axis < 3 else 0.004)
    about_center = gtsam.Pose3(gtsam.Rot3(), box.center_o)
    start = T_CO * about_center * gtsam.Pose3.Expmap(xi) * about_center.inverse()
    rng = np.random.default_rng(axis)
    depth = box_depth(T_CO)
    noisy = depth + np.where(depth < FAR, rng.normal(0.0, 0.003, depth.shape), 0.0)
    found = align(box, view_of(noisy, 0.003), start, iterations=10)
    off = found.localCoordinates(T_CO)
    # As near as the noise lets it: a thousand pixels of 3 mm make about 9 mrad and 0.2 mm.
    information, _ = Evidence(box, view_of(noisy, 0.003), found).normal_equations()
    assert off @ (information + box.prior) @ off < 16.8  # chi square of 6 degrees of freedom, 99 %
    assert np.linalg.norm((box.to_center() @ off)[3:]) < 3e-4


def test_noise_does_not_bias_a_half_covered_ball():
    # The distance field at the noisy points themselves would pull the ball millimetres to a side.
    ball = Shape(build_sdf(trimesh.creation.icosphere(4, RADIUS), resolution=64))
    center_c = np.array([0.0, 0.0, 0.5])
    depth = ball_depth(center_c)
    depth[:, 66:] = np.where(
        depth[:, 66:] < FAR, 0.35, FAR
    )  # a board hides what is right of the centre
    rng = np.random.default_rng(0)
    offsets = []
    for _ in range(20):
        noisy = depth + rng.normal(0.0, 0.008, depth.shape)
        pose = align(ball, view_of(noisy, 0.008), gtsam.Pose3(gtsam.Rot3(), center_c), iterations=5)
        offsets.append(pose.translation() - center_c)
    spread = np.std(offsets, axis=0) / np.sqrt(20)
    assert (np.abs(np.mean(offsets, axis=0)) < 3e-4 + 3 * spread).all()


def test_what_the_image_does_not_show_stays_as_it_was(ball):
    # A ball may turn as it likes; the prior keeps it from spinning on the noise.
    center_c = np.array([0.0, 0.0, 0.5])
    rng = np.random.default_rng(1)
    start = T = gtsam.Pose3(gtsam.Rot3(), center_c)
    for _ in range(30):
        T = align(ball, view_of(ball_depth(center_c) + rng.normal(0, 0.004, (100, 120))), T, 4)
    assert np.linalg.norm(start.rotation().localCoordinates(T.rotation())) < np.deg2rad(8)
    np.testing.assert_allclose(T.translation(), center_c, atol=1e-3)


def test_the_prior_is_about_the_object_s_centre(box):
    # A turn about the centre, 0.1 m away from the frame's origin, is a turn and no shift.
    about_center = gtsam.Pose3(gtsam.Rot3(), box.center_o)
    turn = np.array([0.0, 0.0, 1e-3, 0.0, 0.0, 0.0])
    xi = gtsam.Pose3.Logmap(about_center * gtsam.Pose3.Expmap(turn) * about_center.inverse())
    assert xi @ box.prior @ xi == pytest.approx((1e-3 / STEP_SIGMA[2]) ** 2, rel=1e-6)


def test_noise_is_measured_in_the_image_whatever_the_surface():
    rng = np.random.default_rng(0)
    depth = ball_depth(np.array([0.0, 0.0, 0.5]))
    for sigma in (0.002, 0.012):
        assert noise_of(depth + rng.normal(0.0, sigma, depth.shape)) == pytest.approx(
            sigma, rel=0.1
        )
    assert noise_of(np.zeros((10, 10))) == 0.0


def test_a_crop_shows_the_object_and_keeps_its_rays():
    depth = ball_depth(np.array([0.05, -0.04, 0.5]))
    center_c = np.array([[0.05, -0.04, 0.5]])
    view = crop(depth, CAMERA, center_c, margin=RADIUS + 0.01)
    np.testing.assert_allclose(
        view.camera.back_project(np.where(view.depth < FAR, view.depth, 0.0)),
        CAMERA.back_project(np.where(depth < FAR, depth, 0.0)),
        atol=1e-12,
    )
    assert view.depth.size < depth.size / 3
    assert view.sigma == MIN_SIGMA
    strided = view.strided(3)
    np.testing.assert_array_equal(strided.depth, view.depth[::3, ::3])
    np.testing.assert_allclose(strided.camera.rays(), view.camera.rays()[::3, ::3], atol=1e-12)


@pytest.mark.parametrize("center_c", [(5.0, 0.0, 0.5), (0.0, 0.0, -0.5), (0.0, 0.0, 0.02)])
def test_there_is_no_crop_where_the_camera_does_not_look(center_c):
    assert crop(np.full((100, 120), FAR), CAMERA, np.array([center_c]), margin=0.05) is None


@pytest.mark.parametrize("tilt", [0.0, 0.4, 0.8, 1.1])
def test_a_wall_thinner_than_the_field_s_cells_has_no_holes(plate, tilt):
    cell = 1.0 / plate.grid[2][0]
    assert (plate.grid[0] <= 0.0).mean() < 0.002 and cell > 0.0009
    T_co = gtsam.Pose3(gtsam.Rot3.RzRyRx(tilt, 0.1, 0.3), np.array([0.001, 0.002, 0.5]))
    seen = Evidence(plate, view_of(np.full((CAMERA.height, CAMERA.width), FAR)), T_co)
    rays, normal_c = CAMERA.rays(), T_co.rotation().matrix()[:, 2]
    depth = normal_c @ T_co.translation() / (rays @ normal_c)
    points_o = (rays * depth[..., None] - T_co.translation()) @ T_co.rotation().matrix()
    well_inside = (np.abs(points_o[..., :2]) < [0.043, 0.038]).all(axis=-1)
    hit = np.isfinite(seen.predicted) & well_inside
    assert well_inside.sum() > 300 and hit.sum() > 0.98 * well_inside.sum()
    assert np.abs(seen.predicted - depth)[hit].max() < 1.5 * cell / abs(normal_c[2])


def test_a_thin_wall_is_aligned_with_its_image(plate):
    true = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.6, 0.1, 0.3), np.array([0.001, 0.002, 0.5]))
    seen = Evidence(plate, view_of(np.full((CAMERA.height, CAMERA.width), FAR)), true)
    image = np.where(np.isfinite(seen.predicted), seen.predicted, FAR)
    off = true.compose(gtsam.Pose3.Expmap(np.array([0.04, -0.03, 0.0, 0.0, 0.0, 0.004])))
    found = true.localCoordinates(align(plate, view_of(image, 0.001), off, 15))
    assert np.abs(found[[0, 1]]).max() < 0.005 and abs(found[5]) < 0.0002  # what a plate shows
