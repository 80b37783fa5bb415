# SPDX-License-Identifier: MIT
"""Pose of an AprilTag (family tag36h11) from many images of a tag that does not move.

The tag frame t has its origin at the tag's centre, x to the right and y down on the tag as it is
printed upright, and z into the tag: the camera's own axes where it sees the tag upright and frontal.
OpenCV's aruco dictionary of the same family is turned by 180 degrees about z against this.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import gtsam
import numpy as np

from vtgtsam.camera import CameraIntrinsics

from .camera import CameraError

IMAGES = 30  # as in the paper's experiments
_NEEDED = 20  # of them, or the tag is hardly visible
_MARGIN = 30.0  # least decision margin of a detection; clean ones have above 60
_MAX_ROTATION = np.deg2rad(0.5)  # [rad], greatest spread of a tag at rest
_MAX_TRANSLATION = 0.001  # [m]
_FRONTAL = np.deg2rad(20.0)  # [rad], less tilt than this leaves the orientation uncertain


@dataclass(frozen=True, eq=False)
class TagPose:
    """A tag's pose, averaged over images.

    Attributes:
        T_ct: Pose of the tag in the camera frame.
        accepted: How many images count in the average.
        images: How many there were.
        rotation_spread: Root mean square rotation between an image's pose and the average [rad].
        translation_spread: The same distance between their origins [m].
        tilt: Angle between the tag's normal and the line of sight [rad].
    """

    T_ct: gtsam.Pose3
    accepted: int
    images: int
    rotation_spread: float
    translation_spread: float
    tilt: float

    @property
    def warning(self) -> str:
        """What makes this pose less certain than its spread says, or an empty string."""
        if self.tilt >= _FRONTAL:
            return ""
        return (
            f"the tag faces the camera (tilt {np.rad2deg(self.tilt):.0f} degrees): its orientation may be off by up "
            "to 5 degrees in all images alike; mount it tilted by 30 degrees or more"
        )


class TagDetector:
    """Finds one tag in grey images."""

    def __init__(self, tag_id: int, size: float, intrinsics: CameraIntrinsics) -> None:
        """Prepare to look for the tag.

        Args:
            tag_id: Its number in the family tag36h11.
            size: Side of its black square [m], without the white rim.
            intrinsics: Of the camera.

        Raises:
            CameraError: pupil-apriltags is not installed.
        """
        if not size > 0:
            raise ValueError(f"the tag's size must be positive [m], got {size:g}")
        self.tag_id = tag_id
        self._size = size
        # AprilTag puts the centre of the first pixel at (0.5, 0.5), we put it at (0, 0).
        i = intrinsics
        self._camera = (i.fx, i.fy, i.cx + 0.5, i.cy + 0.5)
        self._detector = _new_detector()

    def detect(self, image: np.ndarray) -> gtsam.Pose3 | None:
        """T_ct, or None where the tag is not clearly visible.

        Args:
            image: Grey (H, W) or RGB (H, W, 3), uint8.
        """
        found = self._detector.detect(
            _grey(image), estimate_tag_pose=True, camera_params=self._camera, tag_size=self._size
        )
        good = [
            tag
            for tag in found
            if tag.tag_id == self.tag_id and tag.hamming == 0 and tag.decision_margin > _MARGIN
        ]
        if len(good) != 1:  # two tags with one number cannot be told apart
            return None
        return gtsam.Pose3(gtsam.Rot3(good[0].pose_R), good[0].pose_t.ravel())


def measure_tag(images: Iterable[np.ndarray], detector: TagDetector) -> TagPose:
    """The pose of a tag at rest, averaged over images.

    Args:
        images: Grey or RGB images; 30 as in the paper.
        detector: Which tag.

    Raises:
        CameraError: The tag was seen in too few images, or it moved.
    """
    poses = [detector.detect(image) for image in images]
    seen = [pose for pose in poses if pose is not None]
    needed = -(-len(poses) * _NEEDED // IMAGES)
    if len(seen) < needed or not seen:
        raise CameraError(
            f"tag {detector.tag_id} of family tag36h11 was clearly visible in {len(seen)} of "
            f"{len(poses)} images, {needed} are needed: check its number, light, sharpness, and that "
            "nothing covers it or its white rim"
        )
    kept = [seen[i] for i in np.flatnonzero(without_outliers(seen))]
    if len(kept) < needed:
        raise CameraError(
            f"the poses of tag {detector.tag_id} agree in {len(kept)} of {len(poses)} images only, "
            f"{needed} are needed: hold camera and hand still, and tilt the tag against the camera"
        )
    return _averaged(kept, len(poses), detector.tag_id)


def without_outliers(poses: Sequence[gtsam.Pose3]) -> np.ndarray:
    """Which poses lie near the medoid, shape (N,).

    The medoid is the pose with the least sum of distances to the others. A pose counts where neither
    its rotation nor its translation is further from the medoid's than the median by three times the
    median absolute deviation, scaled to a standard deviation.
    """
    rotation, translation = _distances(poses)
    # Radians and metres in proportion, so that neither alone chooses the medoid.
    both = rotation / max(np.median(rotation), 1e-9) + translation / max(
        np.median(translation), 1e-9
    )
    medoid = int(np.argmin(both.sum(axis=1)))
    near_in_rotation = _near(rotation[medoid], np.deg2rad(0.02))
    return np.asarray(near_in_rotation & _near(translation[medoid], 2e-5))


def _distances(poses: Sequence[gtsam.Pose3]) -> tuple[np.ndarray, np.ndarray]:
    """Angles [rad] and distances [m] between all pairs, shapes (N, N)."""
    rotations = np.array([pose.rotation().matrix() for pose in poses])
    origins = np.array([pose.translation() for pose in poses])
    # |R_i - R_j| = 2 sqrt(2) sin(angle / 2), in the Frobenius norm: exact for small angles too.
    chords = np.linalg.norm(rotations[:, None] - rotations[None], axis=(2, 3)) / np.sqrt(8.0)
    angles = 2.0 * np.arcsin(np.clip(chords, 0.0, 1.0))
    return angles, np.linalg.norm(origins[:, None] - origins[None], axis=2)


def _near(distances: np.ndarray, floor: float) -> np.ndarray:
    """Which distances are not outliers; floor is what never makes one, for images without noise."""
    median = np.median(distances)
    deviation = 1.4826 * np.median(np.abs(distances - median))
    return np.asarray(distances <= median + np.maximum(3.0 * deviation, floor))


def _averaged(poses: Sequence[gtsam.Pose3], images: int, tag_id: int) -> TagPose:
    from scipy.spatial.transform import Rotation

    rotations = Rotation.from_matrix([pose.rotation().matrix() for pose in poses])
    origins = np.array([pose.translation() for pose in poses])
    rotation, origin = rotations.mean(), origins.mean(axis=0)
    rotation_spread = np.sqrt(np.mean((rotation.inv() * rotations).magnitude() ** 2))
    translation_spread = np.sqrt(np.mean(np.sum((origins - origin) ** 2, axis=1)))
    if rotation_spread > _MAX_ROTATION or translation_spread > _MAX_TRANSLATION:
        raise CameraError(
            f"the poses of tag {tag_id} spread by {np.rad2deg(rotation_spread):.2f} degrees and "
            f"{1e3 * translation_spread:.2f} mm, more than 0.5 degrees or 1 mm: hold camera and hand "
            "still, come closer, or print the tag larger"
        )
    normal, sight = rotation.as_matrix()[:, 2], origin / np.linalg.norm(origin)
    return TagPose(
        T_ct=gtsam.Pose3(gtsam.Rot3(rotation.as_matrix()), origin),
        accepted=len(poses),
        images=images,
        rotation_spread=float(rotation_spread),
        translation_spread=float(translation_spread),
        tilt=float(np.arccos(np.clip(normal @ sight, -1.0, 1.0))),
    )


def _grey(image: np.ndarray) -> np.ndarray:
    if image.ndim == 2:
        return np.ascontiguousarray(image)
    weights = np.array([0.299, 0.587, 0.114])  # ITU-R BT.601
    return np.ascontiguousarray(np.rint(image @ weights).astype(np.uint8))


def _new_detector() -> Any:
    try:
        from pupil_apriltags import Detector
    except ImportError as error:
        raise CameraError(
            f"cannot load the AprilTag detector ({error}); type: pip install pupil-apriltags"
        ) from error
    # Half the resolution for the search only: four times faster, edges are refined in full.
    detector = Detector(families="tag36h11", quad_decimate=2.0)
    # Its destructor frees the family before the detector that still uses it, which may crash the
    # process (1.0.4.post11): hide the family from it.
    detector.tag_families = {}
    return detector
