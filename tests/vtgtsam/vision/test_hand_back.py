# SPDX-License-Identifier: MIT
"""A fused pose moves where a tracker looks, and never what it measures."""

from dataclasses import replace

import gtsam
import numpy as np
import pytest
from test_depth_tracker import CAMERA, T_WC, TILTED, Stage

from vtgtsam import Estimate
from vtgtsam.vision.depth_tracker import DepthTracker
from vtgtsam.vision.hand_back import HandBack, Searches, pose_to_search_at

FAR_OFF = TILTED.compose(
    gtsam.Pose3.Expmap(np.array([0.0, 2.0, 0.0, 0.09, 0.05, 0.0]))
)  # beyond what the tracker's own search reaches in one image


@pytest.fixture(scope="module")
def mug():
    return Stage("mug")


def started(mug, T_wo=TILTED, first=None):
    tracker = DepthTracker(mug.obj, CAMERA)
    tracker.start(T_wo)
    image = mug.image(T_wo) if first is None else first
    assert tracker.update(image, T_WC).status == "ok"
    return tracker


def off(mm, degrees):
    return gtsam.Pose3.Expmap(np.array([np.deg2rad(degrees), 0, 0, 0, 1e-3 * mm, 0]))


def test_a_lost_tracker_finds_the_object_where_it_is_told_to_look(mug):
    image = mug.image(FAR_OFF)
    assert started(mug).update(image, T_WC).status == "lost"
    told = started(mug)
    told.search_at(FAR_OFF.compose(off(3.0, 3.0)))
    found = told.update(image, T_WC)
    assert found.status == "ok" and mug.error(found.T_wo, FAR_OFF) < 0.001


def test_what_it_reports_is_the_images_and_not_the_pose_it_was_told(mug):
    first, image = mug.image(TILTED), mug.image(FAR_OFF)
    found = []
    for hint in (off(4.0, 0.0), off(-4.0, 4.0)):
        tracker = started(mug, first=first)
        tracker.search_at(FAR_OFF.compose(hint))
        found.append(tracker.update(image, T_WC))
    one, other = found
    assert mug.error(one.T_wo, other.T_wo) < 0.0003  # 8 mm between the two hints
    untold = started(mug, FAR_OFF).update(image, T_WC)
    # How noisy a camera is taken to be after one image depends on where that was; a hint would tell far more.
    for told, same in ((one, other), (one, untold), (other, untold)):
        ratio = np.diag(told.covariance) / np.diag(same.covariance)
        assert (np.abs(np.log(ratio)) < np.log(2.5)).all()


def test_a_tracker_that_follows_the_object_is_not_moved_by_a_wrong_pose(mug):
    first, image = mug.image(TILTED), mug.image(TILTED)
    alone, told = started(mug, first=first), started(mug, first=first)
    told.search_at(FAR_OFF)
    # The part of the image that is looked at is larger, and its noise is taken for that of all.
    assert mug.error(told.update(image, T_WC).T_wo, alone.update(image, T_WC).T_wo) < 1e-5


def test_nothing_is_found_where_the_image_shows_nothing(mug):
    tracker = started(mug)
    tracker.search_at(FAR_OFF)
    assert tracker.update(np.zeros((CAMERA.height, CAMERA.width)), T_WC).status == "lost"


def test_a_hint_is_for_one_image_and_forgotten_at_a_start(mug):
    image = mug.image(FAR_OFF)
    tracker = started(mug)
    tracker.search_at(FAR_OFF)
    tracker.start(TILTED)
    assert tracker.update(image, T_WC).status == "lost"
    tracker = started(mug)
    tracker.search_at(FAR_OFF)
    tracker.update(np.zeros((CAMERA.height, CAMERA.width)), T_WC)
    assert tracker.update(image, T_WC).status == "lost"


def estimate(visual_weight=0.0, sigma=(0.02, 0.001), T_wo=FAR_OFF):
    return Estimate(
        time=0.0,
        T_wo=T_wo,
        covariance=np.diag(np.repeat(np.square(sigma), 3)),
        status="ok",
        faults=(),
        mode="held",
        events=(),
        iterations=1,
        error=0.0,
        visual_weight=visual_weight,
        pad_distances=np.zeros(1),
        pad_weights=np.zeros(1),
        contact_points_w=np.zeros((1, 3)),
    )


def test_a_pose_is_handed_back_where_vision_is_missing_or_refused_and_the_pose_is_known():
    assert pose_to_search_at(estimate()).equals(FAR_OFF, 0.0)
    assert pose_to_search_at(estimate(visual_weight=0.05)).equals(FAR_OFF, 0.0)
    assert pose_to_search_at(estimate(visual_weight=0.9)) is None
    assert pose_to_search_at(estimate(sigma=(0.02, 0.02))) is None
    assert pose_to_search_at(estimate(sigma=(0.5, 0.001))) is None
    assert pose_to_search_at(estimate(T_wo=None)) is None
    unknown = replace(estimate(), covariance=np.full((6, 6), np.inf))
    assert pose_to_search_at(unknown) is None


def test_any_tracker_with_the_one_method_can_be_told():
    class Told:
        def __init__(self):
            self.poses = []

        def search_at(self, T_wo):
            self.poses.append(T_wo)

    told = Told()
    assert isinstance(told, Searches)
    hand_back = HandBack(told)
    assert hand_back.after(estimate(visual_weight=1.0)) is None and not told.poses
    assert hand_back.after(estimate()).equals(FAR_OFF, 0.0) and len(told.poses) == 1
