# SPDX-License-Identifier: MIT
"""Our own tracker on a robot's depth images, in a thread of its own: it takes the newest one, and leaves out the rest.

The object is looked for in the open hand, in the median of a few images, until one pose alone explains them; from then
on it is followed. The tracker that knows the hand gets joints and hand pose of the image's instant. Where it has lost
itself it is told where touch and memory have the object (``vision.hand_back``).
"""

from __future__ import annotations

import threading
from collections import deque
from typing import Any

import gtsam
import numpy as np

from ..camera import CameraIntrinsics
from ..exceptions import VtgtsamError
from ..hands.model import HandModel
from ..live.fusion import Fusion
from ..live.inputs import Inputs
from ..live.slots import PoseSlot
from ..objects import ObjectModel
from ..recording.images import decode_depth
from ..recording.topics import DepthTopic
from ..vision.alignment import Shape
from ..vision.depth_tracker import DepthTracker, make_tracker
from ..vision.first_pose import candidates
from ..vision.hand_back import pose_to_search_at
from ..vision.in_hand import IMAGES, object_view, rivals
from .infrared import InfraredImages
from .intake import Intake, Stamps, Unusable
from .publisher_clock import PublisherClock

RAW, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
INFO = "sensor_msgs/msg/CameraInfo"
_KINDS = {"16UC1": (np.uint16, 1e-3), "mono16": (np.uint16, 1e-3), "32FC1": (np.float32, 1.0)}
_PNG = b"\x89PNG"
_WAIT = 0.1  # [s]


def depth_of(message: Any) -> np.ndarray:
    """The depth image of a message [m], float32, shape (H, W), 0 where nothing was measured.

    Raises:
        Unusable: It is of another kind, or not whole.
    """
    data = bytes(message.data)
    if not hasattr(message, "encoding"):
        start = data.find(_PNG)  # compressedDepth has a header of its own before it
        if start < 0:
            raise Unusable(f"has format {message.format!r}, expected a depth image as PNG")
        return decode_depth(data[start:])
    if message.encoding not in _KINDS:
        raise Unusable(f"has encoding {message.encoding!r}, expected {', '.join(_KINDS)}")
    kind, scale = _KINDS[message.encoding]
    dtype = np.dtype(kind).newbyteorder(">" if message.is_bigendian else "<")
    columns = message.step // dtype.itemsize
    if len(data) != message.height * message.step or not 0 < message.width <= columns:
        raise Unusable(f"has {len(data)} bytes for {message.width} x {message.height} pixels")
    image = np.frombuffer(data, dtype).reshape(message.height, columns)[:, : message.width]
    metres = image.astype(np.float32) * np.float32(scale)
    return np.where(np.isfinite(metres), metres, np.float32(0.0))


def intrinsics_of(message: Any) -> CameraIntrinsics:
    """The intrinsics in a CameraInfo, which must be of rectified images.

    Raises:
        ValueError: They are none.
    """
    k = [float(x) for x in message.k]
    return CameraIntrinsics(int(message.width), int(message.height), k[0], k[4], k[2], k[5])


class DepthTracking:
    """Tracks the object in depth images.

    Args:
        entry: The topics.
        hand: The hand.
        obj: The object.
        inputs: Where visual poses go and joints come from.
        camera: The camera's poses.
        fusion: Whose estimate a lost tracker is told, and whose restarts it follows.
        clock: The clock of the stamps.

    Attributes:
        images: What takes the images.
        info: What takes their CameraInfo.
        infrared: The left infrared images beside them; None where the topics name none.
        state: What it does now, in words.
    """

    def __init__(
        self,
        entry: DepthTopic,
        hand: HandModel,
        obj: ObjectModel,
        inputs: Inputs,
        camera: PoseSlot,
        fusion: Fusion,
        clock: PublisherClock,
    ) -> None:
        self._form, self._hand, self._obj = entry.tracker, hand, obj
        self._inputs, self._camera, self._fusion = inputs, camera, fusion
        self._stamps = Stamps(clock)
        self._come = threading.Condition()
        self._newest: tuple[int, Any] | None = None
        self._intrinsics: CameraIntrinsics | None = None
        self._tracker: DepthTracker | None = None
        self._tracks = False
        self._started = 0
        self._seen: deque[np.ndarray] = deque(maxlen=IMAGES)  # while it is looked for
        self.images = Intake(entry.topic, (RAW, COMPRESSED), self._take)
        self.info = Intake(entry.info, (INFO,), self._take_info)
        self.infrared = (
            None if entry.infrared is None else InfraredImages(entry.infrared, Stamps(clock))
        )
        self.state = "waiting for images"

    def _take(self, message: Any) -> None:
        with self._come:
            self._newest = self._stamps.of(message), message
            self._come.notify()

    def _take_info(self, message: Any) -> None:
        if self._intrinsics is None:
            self._intrinsics = intrinsics_of(message)

    def run(self, stop: threading.Event) -> None:
        """Track until ``stop`` is set."""
        while not stop.is_set():
            with self._come:
                if self._newest is None:
                    self._come.wait(_WAIT)
                newest, self._newest = self._newest, None
            if newest is not None:
                self.look(*newest)

    def look(self, stamp_ns: int, message: Any) -> None:
        """Look at one image."""
        with self._inputs.changed:
            joints, T_wh = self._inputs.joints_at(stamp_ns), self._inputs.hand_at(stamp_ns)
            T_wc = self._camera.held(stamp_ns)
        if joints is None or T_wh is None or T_wc is None or self._intrinsics is None:
            self.state = (
                "waiting for joints, the hand's and the camera's pose, and the camera's info"
            )
            return
        try:
            depth = self._intrinsics.check(depth_of(message))
        except (Unusable, ValueError, VtgtsamError) as error:
            self.images.unusable += 1
            self.images.why = str(error)
            return
        if self._tracker is None:
            self._tracker = make_tracker(self._form, self._obj, self._intrinsics, self._hand)
        if self._fusion.started != self._started:  # another object, perhaps
            self._started, self._tracks = self._fusion.started, False
        if not self._tracks:
            self._look_for(depth, T_wc, joints, T_wh)
            return
        estimate = self._fusion.last
        hint = None if estimate is None else pose_to_search_at(estimate)
        if hint is not None:
            self._tracker.search_at(hint)
        infrared = self._infrared_beside(stamp_ns, depth)
        tracked = self._tracker.update(depth, T_wc, joints, T_wh, infrared)
        self.state = "follows the object" if tracked.status == "ok" else "does not see the object"
        if tracked.T_wo is not None:
            self._inputs.put_vision(stamp_ns, tracked.T_wo, tracked.covariance, tracked.correlation)

    def _infrared_beside(self, stamp_ns: int, depth: np.ndarray) -> np.ndarray | None:
        image = None if self.infrared is None else self.infrared.at(stamp_ns)
        if self.infrared is None or image is None or image.shape == depth.shape:
            return image
        self.infrared.intake.unusable += 1
        self.infrared.intake.why = f"has size {image.shape[::-1]}, the depth {depth.shape[::-1]}"
        return None

    def _look_for(
        self, depth: np.ndarray, T_wc: gtsam.Pose3, joints: np.ndarray, T_wh: gtsam.Pose3
    ) -> None:
        assert self._intrinsics is not None and self._tracker is not None
        self._seen.append(depth)
        if len(self._seen) < IMAGES:
            return
        median = np.median(self._seen, axis=0)
        self._seen.clear()
        view = object_view(
            median, self._intrinsics, self._obj, self._hand, joints, T_wc.between(T_wh)
        )
        found = [] if view is None else rivals(candidates(Shape(self._obj.sdf), view), self._obj)
        if len(found) == 1:
            self._tracker.start(T_wc.compose(found[0].T_co))
            self._tracks = True
        self.state = {0: "looks for the object in the hand", 1: "has found the object"}.get(
            len(found), "sees the object, but its image fits several poses: turn it"
        )
