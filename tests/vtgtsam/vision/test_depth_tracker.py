# SPDX-License-Identifier: MIT
"""The tracker against images of MuJoCo's rays: it follows what moves, and says so where it cannot."""

import gtsam
import mujoco
import numpy as np
import pytest

from sim.camera import D435, DepthCamera, add_depth_noise
from vtgtsam import adds, load_hand, load_object
from vtgtsam.vision.depth_tracker import IMAGE, LASTING, DepthTracker, make_tracker

CAMERA = D435.scaled(0.5)
T_WC = gtsam.Pose3(gtsam.Rot3(np.diag([1.0, -1.0, -1.0])), np.array([0.0, 0.0, 0.8]))  # looks down
TILTED = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.9, 0.3, 0.2), np.array([0.01, -0.02, 0.0]))


class Stage:
    """An object that is held before the camera."""

    def __init__(self, name):
        self.obj = load_object(name)
        spec = mujoco.MjSpec()
        vertices, faces = self.obj.mesh.vertices.ravel(), self.obj.mesh.faces.ravel()
        spec.add_mesh(name="mesh", uservert=vertices, userface=faces)
        body = spec.worldbody.add_body(name="object", mocap=True)
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh", contype=0, conaffinity=0)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.camera = DepthCamera(self.model, CAMERA)
        self.rng = np.random.default_rng(0)

    def image(self, T_wo, noise=1.0):
        self.data.mocap_pos[0] = T_wo.translation()
        mujoco.mju_mat2Quat(self.data.mocap_quat[0], T_wo.rotation().matrix().ravel())
        mujoco.mj_kinematics(self.model, self.data)
        depth, _ = self.camera.render(self.data, T_WC)
        return add_depth_noise(depth, self.rng, noise)

    def error(self, T_est, T_true):
        return adds(self.obj.mesh, T_est, T_true)


@pytest.fixture(scope="module")
def mug():
    return Stage("mug")


def step(n):
    """Pose of frame n: 1.5 mm and half a degree a frame, 45 mm and 15 degrees in all."""
    move = gtsam.Pose3.Expmap(np.array([0.004, 0.006, -0.005, 0.001, 0.0008, 0.0008]) * n)
    return TILTED.compose(move)


def test_it_follows_a_moving_object_through_noise(mug):
    tracker = DepthTracker(mug.obj, CAMERA)
    tracker.start(step(0))
    for n in range(31):
        tracked = tracker.update(mug.image(step(n)), T_WC)
        assert tracked.status == "ok"
    assert mug.error(tracked.T_wo, step(30)) < 0.001
    assert mug.error(step(0), step(30)) > 0.01  # standing still would not do
    assert tracked.visible_fraction > 0.5


def test_a_wrong_start_is_corrected_by_the_images_alone(mug):
    off = TILTED.compose(gtsam.Pose3.Expmap(np.array([0.03, -0.03, 0.02, 0.004, -0.003, 0.003])))
    tracker = DepthTracker(mug.obj, CAMERA)
    tracker.start(off)
    for _ in range(8):
        tracked = tracker.update(mug.image(TILTED), T_WC)
    assert mug.error(off, TILTED) > 0.002
    assert mug.error(tracked.T_wo, TILTED) < 0.001


def test_an_empty_image_is_lost_and_the_object_is_found_again(mug):
    tracker = DepthTracker(mug.obj, CAMERA)
    tracker.start(TILTED)
    tracker.update(mug.image(TILTED), T_WC)
    for _ in range(30):
        lost = tracker.update(np.zeros((CAMERA.height, CAMERA.width)), T_WC)
        assert lost.status == "lost" and lost.T_wo is None
        assert np.isinf(np.diag(lost.covariance)).all()
    moved = TILTED.compose(gtsam.Pose3(gtsam.Rot3(), np.array([0.004, 0.0, 0.003])))
    for _ in range(5):
        found = tracker.update(mug.image(moved), T_WC)
    assert found.status == "ok" and mug.error(found.T_wo, moved) < 0.001


def test_it_says_for_how_long_its_errors_stay_and_of_one_image_how_large_they_are(mug):
    fixed = mug.image(TILTED)

    def last(images):
        tracker = DepthTracker(mug.obj, CAMERA)
        tracker.start(TILTED)
        return [tracker.update(image, T_WC) for image in images][-1]

    staying = last([fixed] * 25)
    changing = last([mug.image(TILTED) for _ in range(24)] + [fixed])
    assert staying.correlation > 0.9 * LASTING and changing.correlation < 0.05 * LASTING
    np.testing.assert_allclose(np.diag(staying.covariance), np.diag(changing.covariance), rtol=0.3)


def test_a_pose_followed_through_independent_images_is_surer_than_one_of_them_says(mug):
    hand = load_hand("isyhand")
    joints, out_of_sight = np.zeros(len(hand.joint_names)), gtsam.Pose3(gtsam.Rot3(), [0, 3.0, 0])

    def followed(images):
        tracker = DepthTracker(mug.obj, CAMERA, hand)
        tracker.start(TILTED)
        return [tracker.update(image, T_WC, joints, out_of_sight) for image in images]

    new_each_time = followed([mug.image(TILTED, 4.0) for _ in range(25)])
    staying = followed([mug.image(TILTED, 4.0)] * 25)
    alone, averaged = (np.sqrt(np.diag(new_each_time[n].covariance)) for n in (0, -1))
    assert (averaged < 0.7 * alone).all()
    assert 1.5 * IMAGE < new_each_time[-1].correlation < 0.05 * LASTING
    assert (np.sqrt(np.diag(staying[-1].covariance)) > 0.8 * alone).all()
    assert staying[-1].correlation > 0.9 * LASTING


def test_the_same_images_give_the_same_poses(mug):
    images = [mug.image(step(n)) for n in range(4)]
    ends = []
    for _ in range(2):
        tracker = DepthTracker(mug.obj, CAMERA)
        tracker.start(step(0))
        ends.append([tracker.update(image, T_WC).T_wo for image in images][-1].matrix())
    np.testing.assert_array_equal(ends[0], ends[1])


def test_a_first_pose_that_is_not_seen_yet_is_carried_by_the_hand_and_said_to_be_unsure(mug):
    hand = load_hand("isyhand")
    joints = np.zeros(len(hand.joint_names))
    tracker = DepthTracker(mug.obj, CAMERA, hand)
    beside = gtsam.Pose3(gtsam.Rot3(), np.array([1.0, 0.0, 0.0]))  # the hand is out of sight
    move = gtsam.Pose3(gtsam.Rot3.Rz(0.1), np.array([0.01, 0.0, 0.0]))
    tracker.start(TILTED)
    nothing = np.zeros((CAMERA.height, CAMERA.width))
    tracker.update(nothing, T_WC, joints, beside)
    tracked = tracker.update(nothing, T_WC, joints, move * beside)
    assert tracked.status == "ok"
    assert tracked.T_wo.equals(move * TILTED, 1e-9)
    assert np.sqrt(np.linalg.eigvalsh(tracked.covariance)[0]) > 0.05
    # Once it is seen it is followed from there.
    tracked = tracker.update(mug.image(move * TILTED), T_WC, joints, move * beside)
    assert mug.error(tracked.T_wo, move * TILTED) < 1e-3
    assert np.sqrt(np.linalg.eigvalsh(tracked.covariance)[0]) < 1e-3


def test_an_object_that_is_pushed_while_images_half_deny_it_is_caught_up_with(mug):
    hand = load_hand("isyhand")
    joints, out_of_sight = np.zeros(len(hand.joint_names)), gtsam.Pose3(gtsam.Rot3(), [0, 3.0, 0])
    tracker = DepthTracker(mug.obj, CAMERA, hand)
    tracker.start(TILTED)
    for n in [0] * 10 + list(range(1, 7)) + [6] * 15:
        pushed = gtsam.Pose3(gtsam.Rot3(), np.array([0.0033 * n, 0.0022 * n, 0.0])) * TILTED
        image = mug.image(pushed)
        image[:, ::8] = 1.5  # every eighth column sees through it, wherever it is thought to be
        tracked = tracker.update(image, T_WC, joints, out_of_sight)
        assert tracked.status == "ok"
    assert mug.error(TILTED, pushed) > 0.01
    assert mug.error(tracked.T_wo, pushed) < 0.001


def test_misuse_is_explained(mug):
    tracker = DepthTracker(mug.obj, CAMERA)
    with pytest.raises(ValueError, match="call start"):
        tracker.update(mug.image(TILTED), T_WC)
    tracker.start(TILTED)
    with pytest.raises(ValueError):
        tracker.update(np.zeros((10, 10)), T_WC)
    hand = load_hand("isyhand")
    with pytest.raises(ValueError, match="depth, depth-hand, got 'rgb'"):
        make_tracker("rgb", mug.obj, CAMERA, hand)
    knowing = make_tracker("depth-hand", mug.obj, CAMERA, hand)
    knowing.start(TILTED)
    with pytest.raises(ValueError, match="joint angles"):
        knowing.update(mug.image(TILTED), T_WC)
