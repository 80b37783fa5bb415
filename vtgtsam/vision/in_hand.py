# SPDX-License-Identifier: MIT
"""What lies in the open hand and is not the hand, and which of its possible poses may be believed."""

from __future__ import annotations

import gtsam
import numpy as np

from ..camera import CameraIntrinsics
from ..hands.model import HandModel
from ..metrics import adds
from ..objects import ObjectModel
from .first_pose import Candidate
from .hand_mask import HandMask
from .view import View, crop

IMAGES = 10  # whose median is looked at
GOOD = 0.9  # least score of a pose that is believed; simulated ones had 0.97 to 1, wrong ones up to 0.88
JUMP = 0.015  # [m], between neighbouring pixels; the noise at 0.8 m, 5 mm, is halved by the median
DENIED = 0.05  # largest contradiction of such a pose; right ones had 0, wrong ones 0.1 and more
ALONE = 0.03  # another pose whose score is less than this below is as good ...
APART = 0.003  # [m], ... and is another pose if it is so far away (ADD-S)


def rivals(found: list[Candidate], obj: ObjectModel) -> list[Candidate]:
    """The poses that may be right: none, the one, or the best and others that are as good.

    Args:
        found: Poses, the best first.
        obj: The object.
    """
    good = [c for c in found if c.score >= GOOD and c.contradiction <= DENIED]
    if not good:
        return []
    best, *others = good
    as_good = (c for c in others if c.score > best.score - ALONE)
    return [best, *(c for c in as_good if adds(obj.mesh, c.T_co, best.T_co) > APART)]


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
    box = obj.sdf.upper - obj.sdf.lower if obj.mesh is None else obj.mesh.extents
    size = float(np.linalg.norm(box))  # [m], from corner to corner
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
