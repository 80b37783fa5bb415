# SPDX-License-Identifier: MIT
"""The tracker finds out how its camera errs: how much, how much more at edges, and what errs together."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from vtgtsam.camera import CameraIntrinsics
from vtgtsam.vision import kernels
from vtgtsam.vision.noise import FAR, NEAR, DepthNoise, zones
from vtgtsam.vision.view import View

CAMERA = CameraIntrinsics(width=90, height=80, fx=400.0, fy=400.0, cx=44.5, cy=39.5)
SIGMA = 0.004


def wall(depth=0.8):
    """A face of the object that fills the image."""
    return np.full((CAMERA.height, CAMERA.width), depth)


def smooth_noise(rng, sigma=2.0):
    """Noise whose neighbours err together, of variance 1."""
    noise = gaussian_filter(rng.standard_normal((CAMERA.height, CAMERA.width)), sigma, mode="wrap")
    return noise / noise.std()


def seen(predicted):
    kind = np.full(predicted.shape, kernels.SURFACE, dtype=np.uint8)
    return SimpleNamespace(predicted=predicted, kind=kind)


def view_of(depth, hand_depth=None):
    hand = np.zeros(depth.shape, dtype=bool) if hand_depth is None else depth >= hand_depth - 0.01
    hand_depth = np.full(depth.shape, np.inf) if hand_depth is None else hand_depth
    return View(depth, hand, CAMERA, 0.001, hand_depth)


def learnt(errors, hand_depth=None):
    noise = DepthNoise()
    for error in errors:
        noise.learn(view_of(wall() + error, hand_depth), seen(wall()))
    return noise


def test_independent_noise_is_found_to_be_that():
    rng = np.random.default_rng(0)
    noise = learnt([SIGMA * rng.standard_normal(wall().shape) for _ in range(25)])
    assert noise.sigma == pytest.approx(SIGMA, rel=0.03)
    assert noise.correlation == (1.0, 1.0)
    assert noise.persistence < 0.02


def test_noise_of_patches_is_found_with_its_length():
    rng = np.random.default_rng(1)
    noise = learnt([SIGMA * smooth_noise(rng) for _ in range(25)])
    assert noise.sigma == pytest.approx(SIGMA, rel=0.05)
    # A Gaussian filter of 2 pixels leaves the correlation exp(-k^2 / 16), whose sum is sqrt(16 pi) = 7.1.
    np.testing.assert_allclose(noise.correlation, 7.1, rtol=0.15)
    assert noise.persistence < 0.1  # another patch in each image


def test_noise_that_stays_in_the_image_is_found_to_stay():
    rng = np.random.default_rng(2)
    fixed = smooth_noise(rng)
    errors = [SIGMA * (0.9 * fixed + np.sqrt(0.19) * smooth_noise(rng)) for _ in range(40)]
    assert learnt(errors).persistence == pytest.approx(0.81, abs=0.1)


def test_noise_that_stays_for_some_images_only_lingers():
    rng = np.random.default_rng(4)
    error, errors = smooth_noise(rng), []
    for _ in range(60):
        error = 0.7 * error + np.sqrt(1.0 - 0.7**2) * smooth_noise(rng)
        errors.append(SIGMA * error)
    noise = learnt(errors)
    assert noise.lingering == pytest.approx(0.7, abs=0.1)
    assert noise.persistence < 0.2  # 0.7^10 = 0.03


def test_images_of_which_other_rows_were_looked_at_are_not_compared():
    rng = np.random.default_rng(5)
    fixed = SIGMA * smooth_noise(rng)
    noise = DepthNoise()
    for n in range(40):
        step = 1 + n // 2 % 2
        noise.learn(view_of(wall() + fixed).strided(step), seen(wall()[::step, ::step]))
    assert noise.lingering > 0.95  # of each second pair of neighbours, which are alike
    assert noise.persistence == 1.0  # ten images apart never are: it may all stay


@pytest.mark.parametrize(("stays", "expected"), [(0.0, 0.0), (0.9, 0.81)])
def test_what_is_thin_tells_which_noise_stays_although_all_of_it_is_near_an_edge(stays, expected):
    rng = np.random.default_rng(6)
    marker = np.full(wall().shape, np.inf)
    marker[35:41, 10:80] = 0.8
    behind = np.where(np.isinf(marker), 2.0, marker)
    fixed, noise = rng.standard_normal(marker.shape), DepthNoise()
    for _ in range(60):
        new = np.sqrt(1.0 - stays**2) * rng.standard_normal(marker.shape)
        noise.learn(view_of(behind + SIGMA * (stays * fixed + new)), seen(marker))
    assert noise.persistence == pytest.approx(expected, abs=0.1)
    assert noise.correlation == (1.0, 1.0)


def test_edges_are_distrusted_until_they_were_seen_and_then_taken_as_they_are():
    rng = np.random.default_rng(3)
    hand_depth = np.full(wall().shape, np.inf)
    hand_depth[:, :30] = 0.7  # a finger before the left part
    place = zones(view_of(wall(), hand_depth), seen(wall()))
    assert (place[:, 30 : 30 + NEAR] == np.arange(NEAR)).all() and (place[:, 36:] == FAR).all()

    def excess(edge_error, images):
        noise = DepthNoise()
        for _ in range(images):
            depth = wall() + SIGMA * rng.standard_normal(wall().shape)
            depth[:, 30 : 30 + NEAR] += edge_error
            depth[:, :30] = 0.7
            view = view_of(depth, hand_depth)
            noise.learn(view, seen(wall()))
        return -noise.on(view, seen(wall())).excess[40, 30 : 30 + NEAR]

    assert (excess(0.0, 1) > SIGMA).all()
    assert (excess(0.0, 60) < 0.5 * SIGMA).all()
    fattened = np.linspace(-0.02, 0.0, NEAR)  # as a finger's depth spreads
    found = excess(fattened, 60)
    # A bias counts as noise of which it is the median: careful by half.
    assert found[0] == pytest.approx(1.4826 * 0.02, rel=0.1) and (np.diff(found) < 0.0).all()


def test_what_lies_behind_is_another_zone_than_what_covers():
    predicted = wall()
    predicted[:, 60:] = np.inf  # the object ends there
    place = zones(view_of(wall()), seen(predicted))
    assert (place[:, 60 - NEAR : 60] == NEAR + np.arange(NEAR)[::-1]).all()
    assert (place[:, : 60 - NEAR] == FAR).all()
    steep = wall() + 0.002 * np.arange(CAMERA.width)  # 45 degrees: a slope is no edge
    assert (zones(view_of(steep), seen(steep)) == FAR).all()


def test_a_finger_that_lies_on_the_object_is_no_noise_of_its_surface():
    rng = np.random.default_rng(6)
    noise, evidence = DepthNoise(), seen(wall())
    for n in range(40):
        depth = wall() + SIGMA * rng.standard_normal(wall().shape)
        if n > 10:
            depth[:, 30:50] -= 2.0 * SIGMA
            evidence.kind[:, 30:50] = kernels.COVERED
        noise.learn(view_of(depth), evidence)
    assert noise.correlation == (1.0, 1.0) and noise.persistence < 0.05
    assert noise.sigma == pytest.approx(SIGMA, rel=0.05)


def test_a_few_pixels_that_agree_by_chance_are_not_correlated():
    rng = np.random.default_rng(7)
    lengths = []
    for _ in range(20):
        predicted = np.full(wall().shape, np.inf)
        predicted[:9, :20] = 0.8  # of which 3 rows and 14 columns are far from an edge
        noise = DepthNoise()
        for _ in range(2):
            depth = wall() + SIGMA * rng.standard_normal(wall().shape)
            noise.learn(view_of(depth), seen(predicted))
        lengths.append(max(noise.correlation))
    assert max(lengths) < 2.0
