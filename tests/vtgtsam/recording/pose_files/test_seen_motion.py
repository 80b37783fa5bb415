# SPDX-License-Identifier: MIT
"""Two choices of instants are told apart where poses follow the object at one and not at the other."""

import dataclasses

import gtsam
import numpy as np
import pytest

from vtgtsam import load_object
from vtgtsam.recording.pose_files.motion import Fit, Points, clearly_better, tracked_points

TIMES = np.arange(200) / 30


def moved(t):
    share = 0.5 - 0.5 * np.cos(np.pi * np.clip((t - 2) / 2, 0, 1))
    return gtsam.Pose3(gtsam.Rot3.Ry(share), [0.0, 0.02 * share, 0.1 * share])


def fit(poses, shift, points_o):
    reference = Points.of([moved(t - shift) for t in TIMES])
    return Fit.of(Points.of(poses), reference, points_o)


@pytest.fixture(scope="module")
def points_o():
    return tracked_points(load_object("mug"))


def seen(shift=0.0, noise=1e-3, offset=None, seed=0):
    rng = np.random.default_rng(seed)
    offset = offset or gtsam.Pose3()
    sigma = [5 * noise] * 3 + [noise] * 3
    return [moved(t - shift) * offset * gtsam.Pose3.Expmap(rng.normal(0, sigma)) for t in TIMES]


@pytest.mark.parametrize("shift", [1 / 30, 0.1, -0.5])
@pytest.mark.parametrize("centred", [True, False])
def test_poses_at_one_choice_are_not_at_the_other(points_o, shift, centred):
    poses = seen(shift)
    right, wrong = fit(poses, shift, points_o), fit(poses, 0.0, points_o)
    assert clearly_better(right, wrong, points_o, centred)
    assert not clearly_better(wrong, right, points_o, centred)


def test_halfway_between_two_choices_neither_is_clear(points_o):
    poses = seen(0.05)
    a, b = fit(poses, 0.1, points_o), fit(poses, 0.0, points_o)
    assert not clearly_better(a, b, points_o, True)
    assert not clearly_better(b, a, points_o, True)


@pytest.mark.parametrize("seed", range(10))
def test_what_noise_leaves_open_is_not_clear(points_o, seed):
    poses = seen(0.0, noise=0.02, seed=seed)
    for shift in (1 / 30, -1 / 30):
        assert not clearly_better(
            fit(poses, shift, points_o), fit(poses, 0, points_o), points_o, True
        )


def test_an_object_at_rest_tells_nothing(points_o):
    still = Points.of([moved(0.0)] * len(TIMES))
    one = Fit.of(still, still, points_o)
    assert not clearly_better(one, one, points_o, False)


def test_another_origin_of_the_mesh_takes_no_part(points_o):
    poses = seen(0.1, offset=gtsam.Pose3(gtsam.Rot3.Rz(0.2), [0.03, 0.0, 0.05]))
    right, wrong = fit(poses, 0.1, points_o), fit(poses, 0.0, points_o)
    assert right.score < 0.8 * wrong.score
    assert right.error > 0.03


def test_the_spin_of_what_looks_the_same_turned_takes_no_part():
    can = load_object("can")
    only = {"symmetries_continuous": can.symmetry["symmetries_continuous"]}
    rng = np.random.default_rng(0)
    poses = [moved(t) * gtsam.Pose3(gtsam.Rot3.Rz(rng.uniform(-3, 3)), np.zeros(3)) for t in TIMES]
    for obj, count in ((dataclasses.replace(can, symmetry=only), 2), (can, 1)):
        points_o = tracked_points(obj)  # of what looks the same upside down, its centre alone
        assert len(points_o) == count
        assert fit(poses, 0.0, points_o).error < 1e-9
