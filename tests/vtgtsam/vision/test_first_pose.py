# SPDX-License-Identifier: MIT
from __future__ import annotations

import gtsam
import numpy as np
import pytest

from vtgtsam import adds, load_object
from vtgtsam.camera import CameraIntrinsics
from vtgtsam.vision import ray_kernels
from vtgtsam.vision.alignment import Shape
from vtgtsam.vision.first_pose import candidates, judge, orientations
from vtgtsam.vision.view import View

CAMERA = CameraIntrinsics(width=120, height=120, fx=300.0, fy=300.0, cx=59.5, cy=59.5)


@pytest.fixture(scope="module")
def bottle():
    return load_object("bottle")


def seen(obj, T_co, rng, covered=0):
    """A noisy image of the object alone, some columns of it covered by a hand."""
    T_oc, depth = T_co.inverse(), np.empty((CAMERA.height, CAMERA.width))
    camera = np.array([CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy])
    shape = Shape(obj.sdf)
    pose = (T_oc.rotation().matrix(), np.asarray(T_oc.translation()))
    ray_kernels.render(*shape.grid, shape.box, camera, *pose, depth)
    depth = np.where(depth < np.inf, depth + rng.normal(0.0, 0.001, depth.shape), 0.0)
    hand = np.zeros(depth.shape, dtype=bool)
    hand[:, :covered] = True
    return shape, View(np.where(hand, 0.3, depth), hand, CAMERA, 0.001)


@pytest.mark.parametrize("seed", range(2))
def test_a_bottle_is_found_in_any_orientation(bottle, seed):
    rng = np.random.default_rng(seed)
    R = gtsam.Rot3(orientations(50)[rng.integers(50)])
    T_co = gtsam.Pose3(R, np.array([0.0, 0.0, 0.6]) - R.matrix() @ bottle.center)
    shape, view = seen(bottle, T_co, rng, covered=55 if seed % 2 else 0)
    found = candidates(shape, view)
    assert adds(bottle.mesh, found[0].T_co, T_co) < 0.001  # [m]
    assert [c.score for c in found] == sorted((c.score for c in found), reverse=True)
    assert found[0].score > 0.9


def test_the_score_falls_with_what_is_wrong(bottle):
    T_co = gtsam.Pose3(gtsam.Rot3(), np.array([0.0, 0.0, 0.6]) - bottle.center)
    shape, view = seen(bottle, T_co, np.random.default_rng(0))
    right = judge(shape, view, T_co).score
    beside = judge(shape, view, T_co.compose(gtsam.Pose3(gtsam.Rot3(), np.array([0.02, 0, 0]))))
    behind = judge(shape, view, gtsam.Pose3(gtsam.Rot3(), T_co.translation() + [0, 0, 0.05]))
    assert right > 0.95
    assert behind.score == 0.0 < beside.score < 0.8
    before = judge(shape, view, gtsam.Pose3(gtsam.Rot3(), T_co.translation() - [0, 0, 0.05]))
    assert before.contradiction > 0.9


def test_where_nothing_is_seen_there_are_no_candidates(bottle):
    depth = np.zeros((CAMERA.height, CAMERA.width))
    view = View(depth, np.zeros(depth.shape, dtype=bool), CAMERA, 0.001)
    assert candidates(Shape(bottle.sdf), view) == []


def test_orientations_are_rotations_spread_over_all_of_them():
    R = orientations(300)
    np.testing.assert_allclose(
        R @ R.transpose(0, 2, 1), np.broadcast_to(np.eye(3), R.shape), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(R), 1.0, atol=1e-12)
    rng = np.random.default_rng(0)
    for _ in range(50):
        other = gtsam.Rot3.Expmap(rng.normal(0.0, 2.0, 3)).matrix()
        cosines = (np.einsum("nij,ij->n", R, other) - 1.0) / 2.0
        assert np.rad2deg(np.arccos(min(cosines.max(), 1.0))) < 40.0  # to the nearest
