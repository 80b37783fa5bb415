# SPDX-License-Identifier: MIT
"""The object's first pose, from the camera: what lies on the open hand and is not the hand."""

from __future__ import annotations

import time
from collections.abc import Callable

import gtsam
import numpy as np

from hardware.camera.camera import Camera, CameraError
from vtgtsam import HandModel, ObjectModel, adds
from vtgtsam.exceptions import LiveError
from vtgtsam.vision.alignment import Shape
from vtgtsam.vision.first_pose import Candidate, candidates
from vtgtsam.vision.in_hand import APART, IMAGES, object_view, rivals

PLACING = 60.0  # [s], the most that putting the object there may take where nobody is asked
OLD_IMAGES = 60  # how many may come that were taken before they were asked for


def find_object(
    camera: Camera,
    obj: ObjectModel,
    hand: HandModel,
    joints: np.ndarray,
    T_ch: gtsam.Pose3,
) -> Candidate:
    """Pose T_co of the object on the open hand, and how well it explains the image.

    Args:
        camera: The camera; neither object nor hand may move.
        obj: The object.
        hand: The hand.
        joints: Its joint angles [rad].
        T_ch: Its pose in the camera frame.

    Raises:
        LiveError: The object is not seen, or the image fits several poses; says what to do.
    """
    view = object_view(still_image(camera), camera.intrinsics, obj, hand, joints, T_ch)
    return choose([] if view is None else candidates(Shape(obj.sdf), view), obj, T_ch)


def wait_for_object(
    find: Callable[[], Candidate], obj: ObjectModel, watch: Callable[[], None]
) -> Candidate:
    """Pose T_co of the object once it is found twice at the same place: then nobody holds it any more.

    Args:
        find: Finds it, or raises a LiveError.
        obj: The object.
        watch: Looks after the run meanwhile; raises where it has to end.

    Raises:
        LiveError: It did not come within ``PLACING``; why it was not found last.
    """
    deadline, before = time.monotonic() + PLACING, None
    while True:
        watch()
        try:
            found = find()
        except LiveError:
            if time.monotonic() > deadline:
                raise
            before = None
            continue
        if before is not None and adds(obj.mesh, found.T_co, before.T_co) < APART:
            return found
        before = found


def choose(found: list[Candidate], obj: ObjectModel, T_ch: gtsam.Pose3) -> Candidate:
    """The best of some poses.

    Args:
        found: The poses, the best first.
        obj: The object.
        T_ch: The hand's pose in the camera frame.

    Raises:
        LiveError: It is not good, or another one is as good.
    """
    good = rivals(found, obj)
    if not good:
        explained = f"{100 * found[0].score:.0f}" if found else "0"
        raise LiveError(
            f"{obj.name} was not found in the hand: no pose agrees with the camera's image, the best "
            f"explains {explained} % of what is seen there. Is it on the palm, seen by the camera, "
            "with nothing else near the hand? Else give its pose with --start"
        )
    best = good[0]
    for other in good[1:]:
        apart = adds(obj.mesh, other.T_co, best.T_co)
        raise LiveError(
            f"the camera's image fits two poses of {obj.name} that are {1000 * apart:.0f} mm apart "
            f"(they explain {100 * best.score:.0f} and {100 * other.score:.0f} %): turn it so that "
            f"the camera can tell them apart, or say which is right: --start {as_start(best, T_ch)} "
            f"or --start {as_start(other, T_ch)}"
        )
    return best


def as_start(candidate: Candidate, T_ch: gtsam.Pose3) -> str:
    """A pose as ``--start`` takes it: in the hand frame, x,y,z,qx,qy,qz,qw."""
    T_ho = T_ch.between(candidate.T_co)
    quaternion = T_ho.rotation().toQuaternion()
    numbers = [*T_ho.translation(), *(getattr(quaternion, axis)() for axis in "xyzw")]
    return ",".join(f"{number:.4f}" for number in numbers)


def still_image(camera: Camera) -> np.ndarray:
    """Median of the next depth images [m]; 0 where nothing was measured in most of them.

    Raises:
        CameraError: The camera ended, or its stamps say that its images are all older than the question.
    """
    images: list[np.ndarray] = []
    began = time.monotonic()
    old = 0
    while len(images) < IMAGES:
        frame = camera.read()
        if frame is None:
            raise CameraError(f"{camera.name} ended before the object was found")
        if frame.time >= began:  # an older one may show the hand without it
            images.append(camera.intrinsics.check(frame.depth))
            continue
        old += 1
        if old > OLD_IMAGES:
            raise CameraError(
                f"the stamps of {camera.name} are from {time.monotonic() - frame.time:.1f} s ago: did a clock jump? "
                "Switch the camera off and on, and let nothing set this computer's clock"
            )
    median: np.ndarray = np.median(images, axis=0)
    return median
