# SPDX-License-Identifier: MIT
"""Intel RealSense depth cameras and their recordings (.db3, or .bag of older versions).

Depth is aligned to the colour image, so one set of factory intrinsics, the colour stream's, holds for
both. Beside them comes what the left imager saw, where its infrared images can be had. The library is imported
where it is used: it is an extra, and needs libusb from the system.
"""

from __future__ import annotations

import importlib
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from hardware.device_clock import DeviceClock
from vtgtsam.camera import CameraIntrinsics

from .camera import Camera, CameraError, CameraFrame
from .imager import LeftImages
from .realsense_imager import LEFT, left_imager, pinhole

log = logging.getLogger(__name__)

_WAIT = 2.0  # [s], the longest time without an image; the first one may take a second
_END_WAIT = 0.1  # [s], for the last images of a file that has been read to its end
_OLD, _AHEAD = 0.5, 0.05  # [s], a stamp further from now is not by this computer's clock
_APART = 0.020  # [s], stamps of a depth and a colour image that belong together; a period is 33 ms
_SAME = 0.005  # [s], of a depth and the infrared image it was measured from; the shortest period is 11 ms


@dataclass(frozen=True)
class RealSenseDevice:
    """A connected camera, as ``python -m hardware check`` lists it."""

    name: str
    serial: str
    firmware: str
    usb: str


def find_devices() -> list[RealSenseDevice]:
    """The RealSense cameras that are connected.

    Raises:
        CameraError: The library cannot be loaded.
    """
    rs = _library()
    return [
        RealSenseDevice(
            name=_info(device, rs.camera_info.name),
            serial=_info(device, rs.camera_info.serial_number),
            firmware=_info(device, rs.camera_info.firmware_version),
            usb=_info(device, rs.camera_info.usb_type_descriptor),
        )
        for device in rs.context().query_devices()
    ]


class RealSenseCamera(Camera):
    """A RealSense camera that is streaming."""

    def __init__(
        self,
        serial: str | None = None,
        width: int = 640,
        height: int = 480,
        rate: int = 30,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Begin to stream depth and colour, and the left infrared images where the camera can give them too.

        Args:
            serial: Which camera, needed where more than one is connected.
            width: Of all images [pixels].
            height: Of all images [pixels].
            rate: Images a second [Hz].
            clock: The host's monotonic clock [s].

        Raises:
            CameraError: The camera is not there or cannot stream so.
        """
        rs = _library()
        device = _choose(find_devices(), serial)  # without one, start() would hang for 15 s
        self._stream = _start(rs, device, width, height, rate)
        self._clock = clock
        self._device_clock = DeviceClock()
        self.name = self._stream.name
        self.intrinsics = self._stream.intrinsics
        self.left = self._stream.left

    def read(self) -> CameraFrame:
        """The next images, copied out of the library's small pool at once.

        Raises:
            CameraError: None came for 2 s.
        """
        images = self._stream.next(_WAIT)
        if images is None:
            raise CameraError(f"{self.name}: no image for {_WAIT:g} s; is it still plugged in?")
        frame, by_host = images
        now = self._clock()
        by_device = self._device_clock.to_host(frame.time, now)
        age = time.time() - frame.time
        # The library has told the stamp in the host's wall clock already; that may have been set meanwhile.
        trusted = by_host and -_AHEAD <= age <= _OLD
        return replace(frame, time=now - max(age, 0.0) if trusted else by_device)

    def close(self) -> None:
        """Stop streaming."""
        self._stream.close()


class RealSenseFile(Camera):
    """A recording made by the RealSense tools, read as fast as it is asked for."""

    def __init__(self, path: str | Path) -> None:
        """Open the recording.

        Raises:
            CameraError: It cannot be read, or lacks depth or colour.
        """
        if not Path(path).is_file():
            raise CameraError(f"there is no RealSense recording {path}")
        rs = _library()
        config = rs.config()
        config.enable_device_from_file(str(path), repeat_playback=False)
        self._stream = _Stream(rs, config, str(path), "is it a RealSense recording?")
        self._stopped = rs.playback_status.stopped
        self._playback = self._stream.device.as_playback()
        self._playback.set_real_time(False)
        self.name = f"{self._stream.name} ({path})"
        self.intrinsics = self._stream.intrinsics
        self.left = self._stream.left

    def read(self) -> CameraFrame | None:
        """The next images, or None at the end."""
        for _ in range(round(_WAIT / _END_WAIT)):
            at_end = self._playback.current_status() == self._stopped
            images = self._stream.next(_END_WAIT)
            if images is not None:
                frame, _ = images
                return frame
            if at_end:
                break
        return None

    def close(self) -> None:
        """Close the file."""
        self._stream.close()


def _start(rs: ModuleType, device: RealSenseDevice, width: int, height: int, rate: int) -> _Stream:
    """What a camera streams: the left infrared images too, where it can."""
    name = f"{device.name} {device.serial}"
    advice = "use a USB 3 port and cable, and close other programs that use the camera"
    config = rs.config()
    config.enable_device(device.serial)
    config.enable_stream(rs.stream.depth, width, height, rs.format.z16, rate)
    config.enable_stream(rs.stream.color, width, height, rs.format.rgb8, rate)
    config.enable_stream(rs.stream.infrared, LEFT, width, height, rs.format.y8, rate)
    try:
        return _Stream(rs, config, f"{name} with infrared images", advice)
    except CameraError as error:
        refused = str(error)
    config.disable_stream(rs.stream.infrared)  # here, where nothing holds the first pipeline
    stream = _Stream(rs, config, name, advice)
    log.warning("%s; going on without infrared images", refused)
    return stream


class _Stream:
    """A running pipeline that gives depth and colour images of the same instant, and infrared ones beside them."""

    def __init__(self, rs: ModuleType, config: Any, source: str, advice: str) -> None:
        self._rs = rs
        self._pipeline = rs.pipeline()
        self._align = rs.align(rs.stream.color)
        try:
            profile = self._pipeline.start(config)
        except RuntimeError as error:
            raise CameraError(f"cannot stream from {source}: {error}; {advice}") from error
        try:
            self.device = profile.get_device()
            self.name = _info(self.device, rs.camera_info.name)
            self.intrinsics = _intrinsics(rs, profile, source)
            self.left = left_imager(rs, profile, self.name)
            self._depth_unit = self.device.first_depth_sensor().get_depth_scale()  # [m]
        except BaseException:
            self._pipeline.stop()
            raise

    def next(self, wait: float) -> tuple[CameraFrame, bool] | None:
        """The next images, with the library's stamp, and whether that is by the host's wall clock.

        None where none come in ``wait`` [s].
        """
        deadline = time.monotonic() + wait
        while (left := deadline - time.monotonic()) > 0:
            try:
                arrived, frames = self._pipeline.try_wait_for_frames(int(1000 * left) + 1)
            except RuntimeError as error:  # such as after it was unplugged
                raise CameraError(f"{self.name}: {error}") from error
            if not arrived:
                return None
            depth, color = frames.get_depth_frame(), frames.get_color_frame()
            if not depth or not color:  # a set may lack either, above all the first ones
                continue
            # The library repeats one stream's last image where the other's is late or missing.
            if _apart(depth, color) < _APART:
                return self._copied(frames, depth)
        return None

    def _copied(self, frames: Any, depth: Any) -> tuple[CameraFrame, bool]:
        device_clock = self._rs.timestamp_domain.hardware_clock
        by_host = depth.get_frame_timestamp_domain() != device_clock
        aligned = self._align.process(frames)
        color = np.array(aligned.get_color_frame().get_data())
        left = None if self.left is None else self._left_images(frames, depth)
        depth_image = self._metres(aligned.get_depth_frame())
        return CameraFrame(depth.get_timestamp() / 1000, depth_image, color, left), by_host

    def _left_images(self, frames: Any, depth: Any) -> LeftImages:
        infrared = frames.get_infrared_frame(LEFT)
        fresh = infrared and _apart(depth, infrared) < _SAME
        return LeftImages(self._metres(depth), np.array(infrared.get_data()) if fresh else None)

    def _metres(self, depth: Any) -> np.ndarray:
        image: np.ndarray = np.array(depth.get_data(), dtype=np.float32)
        return image * np.float32(self._depth_unit)

    def close(self) -> None:
        self._pipeline.stop()


def _library() -> ModuleType:
    try:
        return importlib.import_module("pyrealsense2")
    except ImportError as error:  # also where its wheel is there but libusb is not
        raise CameraError(
            f"cannot load the RealSense library ({error}); type: pip install pyrealsense2, and on "
            "Debian or Ubuntu: sudo apt-get install libusb-1.0-0"
        ) from error


def _choose(devices: list[RealSenseDevice], serial: str | None) -> RealSenseDevice:
    found = ", ".join(f"{device.name} {device.serial}" for device in devices) or "none"
    chosen = [device for device in devices if serial in (None, device.serial)]
    if not chosen:
        wanted = "RealSense camera" if serial is None else f"RealSense camera {serial}"
        raise CameraError(f"no {wanted} is connected (found: {found}); check cable and power")
    if len(chosen) > 1:
        raise CameraError(f"more than one RealSense camera is connected ({found}): name a serial")
    return chosen[0]


def _intrinsics(rs: ModuleType, profile: Any, source: str) -> CameraIntrinsics:
    """The colour stream's factory calibration, which holds for the aligned depth as well."""
    streams = {stream.stream_type() for stream in profile.get_streams()}
    if not {rs.stream.depth, rs.stream.color} <= streams:
        raise CameraError(f"{source} lacks depth or colour images, both are needed")
    color = profile.get_stream(rs.stream.color).as_video_stream_profile().get_intrinsics()
    if any(color.coeffs):
        raise CameraError(
            f"{source}: the colour image has lens distortion {list(color.coeffs)}, which this "
            "program does not undo; use a D435, whose images have none"
        )
    return pinhole(color)


def _apart(one: Any, other: Any) -> float:
    """How far the stamps of two frames lie apart [s]."""
    return float(abs(one.get_timestamp() - other.get_timestamp())) / 1000


def _info(device: Any, kind: Any) -> str:
    return str(device.get_info(kind)) if device.supports(kind) else "unknown"
