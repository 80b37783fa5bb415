# SPDX-License-Identifier: MIT
"""The wrist calibration against the depth image: faults that the tag alone does not show."""

from __future__ import annotations

import gtsam
import numpy as np
import pytest

from hardware.camera.camera import CameraError
from hardware.camera.hand_view import check_hand_view, compare_with_depth, find_hand
from hardware.camera.wrist import TagMount, measure_wrist
from hardware.emulate.tag_view import HandCamera
from vtgtsam import load_hand
from vtgtsam.camera import CameraIntrinsics

CAMERA = CameraIntrinsics(640, 480, 615.0, 615.0, 319.5, 239.5)
MOUNT = TagMount(id=0, size=0.04, T_ht=(-0.04, 0.01, 0.04, 0.7071068, -0.7071068, 0, 0))
DOWN = np.arctan2(0.32, 0.31)  # [rad], the paper's camera looks down at the hand by this angle
R_CH = np.array(
    [[0, -1, 0], [-np.sin(DOWN), 0, -np.cos(DOWN)], [np.cos(DOWN), 0, -np.sin(DOWN)]], dtype=float
)
T_CH = gtsam.Pose3(gtsam.Rot3(R_CH), np.array([0.01, 0.02, 0.45]))
MIDDLE_H = np.array([0.09, 0.05, 0.04])  # [m]


@pytest.fixture(scope="module")
def hand():
    return load_hand("isyhand")


@pytest.fixture(scope="module")
def joints(hand):
    return np.full(len(hand.joint_names), 0.1)


@pytest.fixture(scope="module")
def depth(hand, joints):
    return HandCamera(hand, joints, T_CH, MOUNT, CAMERA).read().depth


def off_by(shift, turn):
    """T_ch moved by a shift [m] and turned about the hand's middle [rad], in the camera's axes."""
    middle, R = T_CH.transformFrom(MIDDLE_H), gtsam.Rot3.Expmap(np.array(turn))
    return gtsam.Pose3(R, middle + np.array(shift) - R.matrix() @ middle) * T_CH


@pytest.mark.parametrize(
    ("shift", "turn"),
    [
        ((0, 0, 0), (0, 0, 0)),
        ((0, 0, 0.022), (0, 0, 0)),
        ((0.006, -0.006, 0.006), (0.04, 0.05, 0.02)),
        ((-0.01, 0, 0), (0, 0, 0.07)),
    ],
)
def test_the_image_shows_where_the_hand_truly_is(hand, joints, depth, shift, turn):
    view = find_hand(depth, CAMERA, hand, joints, off_by(shift, turn))
    middle = view.T_ch.transformFrom(MIDDLE_H) - T_CH.transformFrom(MIDDLE_H)
    assert np.linalg.norm(middle) < 0.001
    assert np.linalg.norm(gtsam.Rot3.Logmap(view.T_ch.rotation().between(T_CH.rotation()))) < 0.005
    assert view.rotation == pytest.approx(np.linalg.norm(turn), abs=0.005)


def test_a_right_calibration_is_accepted_with_its_error_in_numbers(hand, joints, depth):
    text = check_hand_view(depth, CAMERA, hand, joints, T_CH)
    assert text.startswith("the depth image shows the hand 0.")


def test_a_pose_off_by_10_mm_and_4_degrees_is_refused(hand, joints, depth):
    wrong = off_by((0.01, 0, 0), (0, np.deg2rad(4), 0))
    with pytest.raises(
        CameraError, match=r"shows the hand \d+\.\d mm and [34]\.\d degrees.*repeat"
    ):
        check_hand_view(depth, CAMERA, hand, joints, wrong)


def test_what_covers_a_part_of_the_hand_says_nothing(hand, joints, depth):
    covered = depth.copy()
    rows, columns = np.nonzero(depth < 1.0)
    covered[: int(np.quantile(rows, 0.4))] = 0.25  # [m], nearer than the hand
    assert find_hand(covered, CAMERA, hand, joints, T_CH).agrees


def test_an_image_without_the_hand_is_refused(hand, joints, depth):
    with pytest.raises(CameraError, match="does not show the hand"):
        find_hand(np.full_like(depth, 1.2), CAMERA, hand, joints, T_CH)
    with pytest.raises(CameraError, match="not in the camera's image"):
        find_hand(depth, CAMERA, hand, joints, off_by((2.0, 0, 0), (0, 0, 0)))


class TestCalibrateWrist:
    @pytest.fixture(autouse=True)
    def _tags(self):
        pytest.importorskip("pupil_apriltags", reason="pupil-apriltags is not installed")

    def test_a_tag_printed_38_mm_instead_of_40_is_refused_with_its_size(self, hand, joints):
        camera = HandCamera(hand, joints, T_CH, MOUNT, CAMERA, printed=0.038)
        T_ch, _, depth = measure_wrist(camera, MOUNT)
        with pytest.raises(
            CameraError, match=r"black square 3[78]\.\d mm in place of the 40\.0 mm"
        ):
            compare_with_depth(T_ch, depth, CAMERA, hand, joints, MOUNT)

    @pytest.mark.slow  # renders and finds the tag as the test beside it
    def test_a_tag_mounted_otherwise_than_its_file_says_is_refused(self, hand, joints):
        turned = MOUNT.pose * gtsam.Pose3(gtsam.Rot3.Rz(np.deg2rad(4)), np.array([0.01, 0, 0]))
        q = turned.rotation().toQuaternion()
        numbers = (*turned.translation(), q.x(), q.y(), q.z(), q.w())
        file = MOUNT.model_copy(update={"T_ht": numbers})
        T_ch, _, depth = measure_wrist(HandCamera(hand, joints, T_CH, MOUNT, CAMERA), file)
        with pytest.raises(CameraError, match=r"correct T_ht"):
            compare_with_depth(T_ch, depth, CAMERA, hand, joints, file)

    def test_the_right_tag_is_accepted(self, hand, joints):
        T_ch, _, depth = measure_wrist(HandCamera(hand, joints, T_CH, MOUNT, CAMERA), MOUNT)
        assert "0." in compare_with_depth(T_ch, depth, CAMERA, hand, joints, MOUNT)
