# SPDX-License-Identifier: MIT
"""The outline in an infrared image: where it is found, what it may disturb it, and what it tells of the pose."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest
import trimesh
from scipy.ndimage import binary_dilation, gaussian_filter, grey_erosion

from vtgtsam import load_hand
from vtgtsam.camera import CameraIntrinsics
from vtgtsam.objects import ObjectModel
from vtgtsam.sdf.build import build_sdf
from vtgtsam.vision import contour as contour_module
from vtgtsam.vision.alignment import Evidence, Shape, align
from vtgtsam.vision.contour import learn_shading
from vtgtsam.vision.depth_tracker import DepthTracker
from vtgtsam.vision.dots import without_dots
from vtgtsam.vision.infrared import Infrared, infrared_part
from vtgtsam.vision.shading import Shading
from vtgtsam.vision.view import View

CAMERA = CameraIntrinsics(width=140, height=120, fx=400.0, fy=410.0, cx=69.3, cy=60.1)
SIDE, FAR, BESIDE = 0.06, 0.9, 90.0  # [m], [m], [gray levels]
TILTED = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.5, -0.6, 0.2), np.array([0.004, -0.003, 0.6]))
FACE_ON = gtsam.Pose3(gtsam.Rot3.Ry(np.pi), np.array([0.0, 0.0, 0.6]))
LIGHT = np.array([50.0, 6.0, -20.0, -15.0])  # [gray levels], as ``Shading`` has it


@pytest.fixture(scope="module")
def cube():
    return ObjectModel("cube", build_sdf(trimesh.creation.box((SIDE,) * 3), resolution=96))


@pytest.fixture(scope="module")
def shape(cube):
    return Shape(cube.sdf)


def known_light():
    """A shading that was told the light."""
    shading = Shading()
    normals = np.random.default_rng(0).standard_normal((500, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    shading.learn((LIGHT[0] + normals @ LIGHT[1:])[None], normals[None])
    return shading


def seen_of(shape, T_co):
    """The exact prediction at a pose."""
    empty = np.zeros((CAMERA.height, CAMERA.width))
    return Evidence(shape, View(empty, empty > 0.0, CAMERA, 0.001), T_co)


def image_of(shape, T_co, light=LIGHT, noise=2.0, beside=BESIDE):
    """A blurred, noisy image of the object before something even, four times as fine before it is blurred."""
    fine = CAMERA.scaled(4.0)
    empty = np.zeros((fine.height, fine.width))
    seen = Evidence(shape, View(empty, empty > 0.0, fine, 0.001), T_co)
    image = np.where(seen.predicted < np.inf, light[0] + seen.normals_c @ light[1:], beside)
    image = image.reshape(CAMERA.height, 4, CAMERA.width, 4).mean(axis=(1, 3))
    noisy = gaussian_filter(image, 0.6) + noise * np.random.default_rng(1).standard_normal(
        image.shape
    )
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def view_of(shape, T_co, image, hand_depth=None):
    """A view of the object there with that image; its depth is exact."""
    predicted = seen_of(shape, T_co).predicted
    depth = np.where(predicted < np.inf, predicted, FAR)
    view = View(depth, np.zeros(depth.shape, dtype=bool), CAMERA, 0.001)
    if hand_depth is not None:
        view = replace(view, hand_depth=hand_depth)
    return replace(view, infrared=infrared_part(image, CAMERA, CAMERA, known_light()))


def contour_at(shape, view, T_co):
    return Evidence(shape, view, T_co).contour


def moved(T_co, right, down):
    """The pose so many pixels away in the image."""
    x, y, z = T_co.translation()
    return gtsam.Pose3(T_co.rotation(), [x + right * z / CAMERA.fx, y + down * z / CAMERA.fy, z])


def test_the_outlines_jacobian_is_that_of_finite_differences(shape):
    contour = contour_at(shape, view_of(shape, TILTED, image_of(shape, TILTED)), TILTED)

    def places(xi):
        points_c = TILTED.retract(xi).transformFrom(contour.points_o.T).T
        return (contour.normals * CAMERA.project(points_c)).sum(axis=1)

    steps = 1e-6 * np.eye(6)
    expected = np.column_stack([(places(step) - places(-step)) / 2e-6 for step in steps])
    np.testing.assert_allclose(contour.jacobian(), expected, atol=1e-3)  # of up to 700 pixels / m
    assert len(contour.points_o) > 100


def test_points_of_the_outline_project_to_it_and_its_normals_point_outward(shape):
    contour = contour_at(shape, view_of(shape, TILTED, image_of(shape, TILTED)), TILTED)
    found = CAMERA.project(TILTED.transformFrom(contour.points_o.T).T)
    np.testing.assert_allclose(found, contour.pixels, atol=0.1)  # half a step of the bisection
    inside = seen_of(shape, TILTED).predicted < np.inf
    for sign, expected in ((-1.5, True), (1.5, False)):
        u, v = np.rint(contour.pixels + sign * contour.normals).astype(int).T
        assert (inside[v, u] == expected).mean() > 0.97  # but for corners


@pytest.mark.parametrize("offset", [(0.0, 0.0), (2.0, -1.0), (-3.0, 2.0)])
def test_the_outline_is_found_where_the_image_shows_it(shape, offset):
    view = view_of(shape, TILTED, image_of(shape, TILTED))
    contour = contour_at(shape, view, moved(TILTED, *offset))
    means, variances = contour.places.T
    sure = variances < 0.5
    expected = -contour.normals @ np.array(offset)
    assert sure.mean() > 0.6
    assert np.median(np.abs(means - expected)[sure]) < 0.25
    assert abs(np.median((means - expected)[sure])) < 0.2  # places are tried half a pixel apart


def test_dots_do_not_move_it(shape):
    image = image_of(shape, TILTED)
    dotted = image.astype(float)
    rng = np.random.default_rng(3)
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width]
    for x, y in rng.uniform(
        0.0, (CAMERA.width, CAMERA.height), (CAMERA.width * CAMERA.height // 90, 2)
    ):
        dotted += 120.0 * np.exp(-0.5 * ((u - x) ** 2 + (v - y) ** 2) / 0.9**2)
    dotted = np.clip(dotted, 0, 255).astype(np.uint8)
    T_co = moved(TILTED, 1.5, 1.0)
    contour = contour_at(shape, view_of(shape, TILTED, dotted), T_co)
    means, variances = contour.places.T
    expected = -contour.normals @ np.array([1.5, 1.0])
    sure = variances < 0.5
    assert sure.mean() > 0.4
    assert np.median(np.abs(means - expected)[sure]) < 0.35
    raw = Infrared(dotted.astype(float), known_light())  # with the dots in it
    spoilt = contour_at(shape, replace(view_of(shape, TILTED, dotted), infrared=raw), T_co)
    wrong = np.abs(spoilt.places[:, 0] - expected)[spoilt.places[:, 1] < 0.5]
    assert (wrong > 1.0).mean() > 3.0 * (np.abs(means - expected)[sure] > 1.0).mean()


def test_dots_are_left_out_and_edges_are_not():
    image = np.full((40, 60), 40, dtype=np.uint8)
    image[:, 30:] = 90
    image[10:13, 10:13] = image[20:23, 45:48] = 220
    brightness = without_dots(image)
    assert np.isnan(brightness[10:13, 10:13]).all() and np.isnan(brightness[20:23, 45:48]).all()
    assert np.isnan(brightness).sum() < 60
    np.testing.assert_array_equal(brightness[30:, :], image[30:, :])


def test_where_there_is_no_contrast_it_tells_nothing(shape):
    shown = contour_at(shape, view_of(shape, TILTED, image_of(shape, TILTED)), TILTED)
    flat = image_of(shape, TILTED, np.array([60.0, 0.0, 0.0, 0.0]), beside=60.0)
    view = view_of(shape, TILTED, flat)
    shading = Shading()
    view = replace(view, infrared=replace(view.infrared, shading=shading))
    learn_shading(view, Evidence(shape, view, TILTED))
    assert shading.sigma == pytest.approx(3.0, abs=0.5)
    hidden = contour_at(shape, view, TILTED)
    told, known = (np.trace(c.normal_equations()[0][3:, 3:]) for c in (hidden, shown))
    assert told < 0.02 * known


def test_what_the_hand_may_cover_is_left_out(shape):
    image = image_of(shape, TILTED)
    hand_depth = np.full(image.shape, np.inf)
    hand_depth[:, 80:] = 0.5
    whole = contour_at(shape, view_of(shape, TILTED, image), TILTED)
    view = view_of(shape, TILTED, image, hand_depth)
    contour = contour_at(shape, view, TILTED)
    assert (whole.pixels[:, 0] > 77).any()
    assert (contour.pixels[:, 0] < 77).all() and len(contour.pixels) > 50
    brightness = view.infrared.brightness.copy()
    brightness[:, 79:] = 255.0  # and what the lines meet of it does not count
    painted = replace(view, infrared=replace(view.infrared, brightness=brightness))
    again = contour_at(shape, painted, TILTED)
    np.testing.assert_allclose(again.places, contour.places)
    behind = np.full(image.shape, 0.8)  # a hand behind the object covers nothing
    assert len(contour_at(shape, view_of(shape, TILTED, image, behind), TILTED).pixels) == len(
        whole.pixels
    )


def test_edges_inside_the_object_are_no_outline(shape):
    # The brightest face borders on two darker ones: a larger step than that to what lies beside.
    image = image_of(shape, TILTED, np.array([60.0, 10.0, -45.0, -5.0]))
    view = view_of(shape, TILTED, image)
    shading = Shading()
    view = replace(view, infrared=replace(view.infrared, shading=shading))
    learn_shading(view, Evidence(shape, view, TILTED))
    means, variances = contour_at(shape, view, TILTED).places.T
    assert (np.abs(means[variances < 0.5]) < 1.0).mean() > 0.9


def test_another_edge_beside_the_object_is_not_taken_for_its_outline(shape):
    # A palm behind: next to the object a strip about as dark as the object, then something bright.
    inside = seen_of(shape, FACE_ON).predicted < np.inf
    strip = binary_dilation(inside, iterations=4)
    image = image_of(shape, FACE_ON).astype(float)
    brightness = image[inside].mean()
    image[strip & ~inside] = brightness + 12.0
    image[~strip] = 170.0
    image = gaussian_filter(image, 0.6) + 2.0 * np.random.default_rng(2).standard_normal(
        image.shape
    )
    view = view_of(shape, FACE_ON, np.rint(image).astype(np.uint8))
    means, variances = contour_at(shape, view, FACE_ON).places.T
    assert (variances < 1.0).mean() > 0.3
    assert (np.abs(means[variances < 1.0]) < 1.0).mean() > 0.9


def test_a_cube_seen_face_on_that_depth_lets_slide_is_put_back(shape):
    offset = (3.0, -2.0)
    predicted = seen_of(shape, FACE_ON).predicted
    fattened = grey_erosion(np.where(predicted < np.inf, predicted, FAR), size=(11, 11))
    view = view_of(shape, FACE_ON, image_of(shape, FACE_ON))
    view = replace(view, depth=fattened)
    start = moved(FACE_ON, *offset)
    by_depth = align(shape, replace(view, infrared=None), start, iterations=8)
    by_both = align(shape, view, start, iterations=8)
    assert np.linalg.norm((by_depth.translation() - FACE_ON.translation())[:2]) > 0.003
    np.testing.assert_allclose(by_both.translation(), FACE_ON.translation(), atol=0.0006)
    assert np.linalg.norm(gtsam.Rot3.Logmap(by_both.rotation().between(FACE_ON.rotation()))) < 0.02


def test_an_outline_that_is_wider_all_around_does_not_bring_the_object_nearer(shape, monkeypatch):
    closer = gtsam.Pose3(FACE_ON.rotation(), FACE_ON.translation() * 0.99)  # half a pixel a side
    view = view_of(shape, closer, image_of(shape, closer))

    def toward_camera():
        information, gradient, _ = contour_at(shape, view, FACE_ON).normal_equations()
        by_depth = np.diag([0.0, 0.0, 0.0, 0.0, 0.0, 1.0 / 0.001**2])
        return abs(np.linalg.solve(information + by_depth + shape.prior, gradient)[5])

    kept = toward_camera()
    monkeypatch.setattr(contour_module, "COMMON", 1e-6)
    assert kept < 0.5 * toward_camera() and kept < 0.0006


def test_every_second_row_and_column_shows_the_same_outline(shape):
    view = view_of(shape, TILTED, image_of(shape, TILTED))
    T_co = moved(TILTED, 2.0, 1.0)
    steps = []
    for v in (view, view.strided(2)):
        information, gradient, _ = contour_at(shape, v, T_co).normal_equations()
        steps.append(-np.linalg.solve(information + 0.01 * shape.prior, gradient))
    in_camera = [T_co.rotation().matrix() @ step[3:] for step in steps]
    np.testing.assert_allclose(in_camera[0][:2], in_camera[1][:2], atol=0.001)
    assert np.linalg.norm(in_camera[0][:2]) > 0.002


def test_a_side_that_comes_into_sight_late_and_in_few_pixels_is_learnt_as_well():
    light = np.array([50.0, 40.0, -20.0, -15.0])
    normals = np.repeat([[0.0, -0.8, -0.6], [0.0, 0.6, -0.8], [0.9, 0.1, -0.42]], [600, 300, 60], axis=0)  # fmt: skip
    rng = np.random.default_rng(0)
    shading, brightness = Shading(), light[0] + normals @ light[1:]
    for count in [900] * 5 + [960] * 20:  # the pose is a little off, and the normals are
        believed = normals[:count] + 0.1 * rng.standard_normal((count, 3))
        shading.learn((brightness[:count] + rng.standard_normal(count))[None], believed[None])
    assert abs(shading.of(normals[-1]) - brightness[-1]) < 12.0  # of 36 that it is brighter


def test_prints_on_an_object_make_its_shading_unsure_by_whole_patches():
    rng = np.random.default_rng(0)
    normals = np.tile([0.0, 0.0, -1.0], (48, 60, 1))
    coarse = rng.choice([30.0, 110.0], (8, 10))
    printed, noisy = Shading(), Shading()
    printed.learn(np.kron(coarse, np.ones((6, 6))), normals)
    noisy.learn(rng.choice([30.0, 110.0], (48, 60)), normals)
    assert printed.sigma > 30.0 and noisy.sigma > 30.0
    assert 4.0 < printed.alike < 10.0 and noisy.alike < 1.3  # patches are six pixels wide
    few = np.full((48, 60), np.nan)
    few[0, :3] = 0.0  # too few say nothing
    noisy.learn(few, normals)
    assert noisy.images == 1


def test_prints_weigh_an_outline_down_that_even_colour_shows(shape):
    image = image_of(shape, TILTED)
    patches = np.kron(np.random.default_rng(4).choice([-1.0, 1.0], (20, 24)), np.ones((6, 6)))
    told = []
    for contrast in (0.0, 25.0):
        shown = image + contrast * patches[: CAMERA.height, : CAMERA.width]
        view = view_of(shape, TILTED, np.clip(shown, 0, 255).astype(np.uint8))
        view = replace(view, infrared=replace(view.infrared, shading=Shading()))
        learn_shading(view, Evidence(shape, view, TILTED))
        told.append(np.trace(contour_at(shape, view, TILTED).normal_equations()[0][3:, 3:]))
    assert told[1] < 0.1 * told[0]


def test_the_tracker_that_knows_the_hand_uses_it_and_the_other_does_not(cube, shape):
    hand = load_hand("isyhand")
    joints, away = np.zeros(len(hand.joint_names)), gtsam.Pose3(gtsam.Rot3(), [0.0, 5.0, 0.0])
    image = image_of(shape, FACE_ON)
    predicted = seen_of(shape, FACE_ON).predicted
    depth = grey_erosion(np.where(predicted < np.inf, predicted, FAR), size=(11, 11))

    def end(tracker, infrared):
        tracker.start(moved(FACE_ON, 3.0, -2.0))
        for _ in range(10):
            tracked = tracker.update(depth, gtsam.Pose3(), joints, away, infrared=infrared)
        return np.linalg.norm((tracked.T_wo.translation() - FACE_ON.translation())[:2])

    knows, other = DepthTracker(cube, CAMERA, hand), DepthTracker(cube, CAMERA)
    assert end(knows, image) < 0.001 < 0.003 < end(knows, None)
    assert end(other, image) == end(other, None)


@pytest.mark.parametrize("image", [np.zeros((5, 5), dtype=np.uint8), np.zeros((120, 140))])
def test_an_image_of_another_size_or_type_is_refused(cube, image):
    hand = load_hand("isyhand")
    tracker = DepthTracker(cube, CAMERA, hand)
    tracker.start(FACE_ON)
    joints = np.zeros(len(hand.joint_names))
    with pytest.raises(ValueError, match="infrared image must be of uint8"):
        tracker.update(np.full((120, 140), FAR), gtsam.Pose3(), joints, infrared=image)
