# SPDX-License-Identifier: MIT
"""The object's first pose, from the camera: what lies on the open hand and is not the hand."""

from __future__ import annotations

import time

import gtsam
import numpy as np

from hardware.camera.camera import Camera, CameraError
from vtgtsam import HandModel, ObjectModel, adds
from vtgtsam.camera import CameraIntrinsics
from vtgtsam.exceptions import LiveError
from vtgtsam.vision.alignment import Shape
from vtgtsam.vision.first_pose import Candidate, candidates
from vtgtsam.vision.hand_mask import HandMask
from vtgtsam.vision.view import View, crop

IMAGES = 10  # whose median is looked at
OLD_IMAGES = 60  # how many may come that were taken before they were asked for
GOOD = 0.9  # least score of a pose that is believed; simulated ones had 0.97 to 1, wrong ones up to 0.88
JUMP = 0.015  # [m], between neighbouring pixels; the noise at 0.8 m, 5 mm, is halved by the median
DENIED = 0.05  # largest contradiction of such a pose; right ones had 0, wrong ones 0.1 and more
ALONE = 0.03  # another pose whose score is less than this below is as good ...
APART = 0.003  # [m], ... and is another pose if it is so far away (ADD-S)


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


def object_view(
    depth: np.ndarray,
    camera: CameraIntrinsics,
    obj: ObjectModel,
    hand: HandModel,
    joints: np.ndarray,
    T_ch: gtsam.Pose3,
) -> View | None:
    """The part of a depth image [m] that shows the largest thing over the pads that is not the hand.

    None where there is none. All else counts as hand: it says nothing for or against the object.
    """
    size = float(np.linalg.norm(obj.mesh.extents))  # [m], from corner to corner
    is_hand = HandMask(hand).mask(depth, camera, T_ch.inverse(), joints)
    pads_h = hand.pad_transforms(joints)[:, :3, 3]
    may_be = _over_pads(depth, camera, T_ch, pads_h, size) & ~is_hand
    thing = _largest(may_be & ~_jumps(np.where(may_be, depth, np.nan)))
    if not thing.any():
        return None
    points_c = camera.back_project(np.where(thing, depth, 0.0))
    view = crop(depth, camera, points_c, margin=size / 2)
    if view is None:
        return None
    left, top = round(camera.cx - view.camera.cx), round(camera.cy - view.camera.cy)
    view.hand[:] = ~thing[top:, left:][: view.camera.height, : view.camera.width]
    return view


def choose(found: list[Candidate], obj: ObjectModel, T_ch: gtsam.Pose3) -> Candidate:
    """The best of some poses.

    Args:
        found: The poses, the best first.
        obj: The object.
        T_ch: The hand's pose in the camera frame.

    Raises:
        LiveError: It is not good, or another one is as good.
    """
    good = [c for c in found if c.score >= GOOD and c.contradiction <= DENIED]
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
        if other.score > best.score - ALONE and apart > APART:
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


def _over_pads(
    depth: np.ndarray,
    camera: CameraIntrinsics,
    T_ch: gtsam.Pose3,
    pads_h: np.ndarray,
    size: float,
) -> np.ndarray:
    """Which pixels may show an object of that size [m] whose middle is among the pads."""
    points_c = (camera.rays() * depth[..., None]).reshape(-1, 3)
    points_h = (points_c - T_ch.translation()) @ T_ch.rotation().matrix()
    lower, upper = pads_h.min(axis=0) - size / 2, pads_h.max(axis=0) + size / 2
    inside: np.ndarray = ((points_h > lower) & (points_h < upper)).all(axis=1)
    return inside.reshape(depth.shape) & (depth > 0.0)


def _jumps(depth: np.ndarray) -> np.ndarray:
    """Where one thing ends and another one behind it begins, as a forearm behind an object."""
    rows, columns = (np.abs(np.diff(depth, axis=axis)) > JUMP for axis in (0, 1))
    jumps = np.zeros(depth.shape, dtype=bool)
    jumps[1:] |= rows
    jumps[:, 1:] |= columns
    return jumps


def _largest(pixels: np.ndarray) -> np.ndarray:
    """The largest connected part of some pixels, both of shape (height, width)."""
    from scipy import ndimage

    labels, count = ndimage.label(pixels)
    sizes = np.bincount(labels.ravel(), minlength=count + 1)
    sizes[0] = 0  # what is in no part
    largest: np.ndarray = (labels == sizes.argmax()) & pixels
    return largest
