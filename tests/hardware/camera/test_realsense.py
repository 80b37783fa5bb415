# SPDX-License-Identifier: MIT
"""The genuine RealSense library without a camera: its software device, recorded and played back."""

import re
import sys
import time
from dataclasses import dataclass
from types import SimpleNamespace

import gtsam
import numpy as np
import pytest

from hardware.camera import realsense
from hardware.camera.camera import CameraError, CameraFrame, open_camera
from hardware.camera.imager import LeftImager
from hardware.camera.realsense import RealSenseCamera, RealSenseDevice, RealSenseFile
from vtgtsam.camera import CameraIntrinsics

WIDTH, HEIGHT, COUNT = 160, 120, 8
DEPTH_VIEW = (
    190.0,
    190.0,
    80.0,
    60.0,
    0.0,
)  # fx, fy, cx, cy [pixels], first coefficient of distortion
PARALLEL = [1, 0, 0, 0, 1, 0, 0, 0, 1]


@pytest.fixture(scope="module")
def rs():
    try:
        import pyrealsense2
    except ImportError as error:
        pytest.skip(f"the RealSense library cannot be loaded: {error}")
    return pyrealsense2


def stream(rs, sensor, kind, encoding, depth_bytes, intrinsics, uid, index=0, size=(WIDTH, HEIGHT)):
    video = rs.video_stream()
    video.type, video.fmt, video.bpp = kind, encoding, depth_bytes
    video.index, video.uid, video.fps = index, uid, 30
    video.width, video.height = size
    values = rs.intrinsics()
    values.width, values.height = size
    values.fx, values.fy, values.ppx, values.ppy = intrinsics[:4]
    values.model = rs.distortion.brown_conrady
    values.coeffs = [*intrinsics[4:], 0, 0, 0, 0][:5]
    video.intrinsics = values
    return sensor.add_video_stream(video).as_video_stream_profile()


def push(rs, sensor, profile, pixels, number):
    frame = rs.software_video_frame()
    frame.bpp = pixels.strides[1]
    frame.stride = pixels.strides[0]
    frame.timestamp = 1000.0 + 33.3 * number  # [ms]
    frame.domain = rs.timestamp_domain.hardware_clock
    frame.frame_number = number
    frame.profile = profile
    frame.pixels = pixels
    sensor.on_video_frame(frame)


@dataclass
class Infrared:
    """The infrared stream of a recording; images whose number is in ``missing`` do not come."""

    view: tuple = DEPTH_VIEW
    index: int = 1
    size: tuple = (WIDTH, HEIGHT)
    format: str = "y8"
    missing: tuple = ()

    def image(self, k):
        return np.full(
            self.size[::-1], 30 + k, dtype=np.uint8 if self.format == "y8" else np.uint16
        )


def extrinsics(rs, columns, translation):
    found = rs.extrinsics()
    found.rotation, found.translation = columns, translation
    return found


def make_recording(rs, path, color_intrinsics, color=True, infrared=None, turned=PARALLEL):
    device = rs.software_device()
    device.register_info(rs.camera_info.name, "Soft D435")
    device.register_info(rs.camera_info.serial_number, "77")
    depth_sensor, color_sensor = device.add_sensor("Depth"), device.add_sensor("Color")
    depth_sensor.add_read_only_option(rs.option.depth_units, 0.001)
    kinds = rs.stream, rs.format
    depth = stream(rs, depth_sensor, kinds[0].depth, kinds[1].z16, 2, DEPTH_VIEW, 0)
    colored = stream(rs, color_sensor, kinds[0].color, kinds[1].rgb8, 3, color_intrinsics, 1)
    depth.register_extrinsics_to(colored, extrinsics(rs, turned, [0.015, 0, 0]))
    if infrared is not None:
        encoding = getattr(rs.format, infrared.format)
        left = stream(
            rs, depth_sensor, kinds[0].infrared, encoding, infrared.image(0).itemsize, infrared.view, 2,
            infrared.index, infrared.size,
        )  # fmt: skip
        depth.register_extrinsics_to(left, extrinsics(rs, PARALLEL, [0, 0, 0]))
    recorder = rs.recorder(str(path), device)
    sensors = recorder.query_sensors() if color else recorder.query_sensors()[:1]
    queues = [rs.frame_queue(50) for _ in sensors]
    for sensor, queue in zip(sensors, queues, strict=True):
        sensor.open(sensor.get_stream_profiles())
        sensor.start(queue)
    images = []  # the library does not copy what it is given
    for k in range(COUNT):
        images.append(np.full((HEIGHT, WIDTH), 500 + k, dtype=np.uint16))
        push(rs, depth_sensor, depth, images[-1], k)
        if infrared is not None and k not in infrared.missing:
            images.append(infrared.image(k))
            push(rs, depth_sensor, left, images[-1], k)
        if color:
            images.append(np.full((HEIGHT, WIDTH, 3), 20 * k, dtype=np.uint8))
            push(rs, color_sensor, colored, images[-1], k)
        time.sleep(0.02)
    for sensor in sensors:
        sensor.stop()
        sensor.close()
    recorder.pause()
    return path


def read_all(camera):
    frames = []
    while (frame := camera.read()) is not None:
        frames.append(frame)
    return frames


PLAIN = (150.0, 151.0, 79.3, 60.6, 0.0)
POSE = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.05, -0.02, 0.1), np.array([0.015, 0.0, 0.0]))
TURNED = POSE.rotation().matrix().T.ravel().tolist()  # the library holds columns


@pytest.fixture(scope="module")
def recording(rs, tmp_path_factory):
    return make_recording(rs, tmp_path_factory.mktemp("rs") / "images.db3", PLAIN)


def test_a_recording_comes_back_through_the_genuine_pipeline(recording):
    frames = []
    with RealSenseFile(recording) as camera:
        assert "D435" in camera.name or str(recording) in camera.name
        found = camera.intrinsics
        while (frame := camera.read()) is not None:
            frames.append(frame)
    assert (found.width, found.height) == (WIDTH, HEIGHT)
    np.testing.assert_allclose((found.fx, found.fy, found.cx, found.cy), PLAIN[:4], rtol=1e-6)
    assert len(frames) >= COUNT - 2  # the pipeline may drop the first while it starts
    for frame in frames:
        k = round((frame.time - 1.0) / 0.0333)
        assert frame.time == pytest.approx(1.0 + 0.0333 * k, abs=1e-6)
        assert (frame.color == 20 * k).all()  # the image of the same instant
        seen = frame.depth[frame.depth > 0]
        np.testing.assert_allclose(seen, 0.500 + 0.001 * k, atol=1e-6)
        assert frame.depth.shape == (HEIGHT, WIDTH) and frame.depth.dtype == np.float32


def test_depth_is_aligned_to_the_colour_image(recording):
    """A pixel's ray in the wider colour view meets the plane beside where the depth view ends."""
    with RealSenseFile(recording) as camera:
        depth = camera.read().depth
    columns = np.flatnonzero((depth > 0).any(axis=0))
    # Left edge: x/z = (0 - 80) / 190, moved by 15 mm at 0.5 m, seen by the colour camera.
    left = ((0 - 80) / 190 + 0.015 / 0.5) * PLAIN[0] + PLAIN[2]
    assert abs(columns[0] - left) < 1.5


def test_frames_stay_as_they_were_when_later_ones_arrive(recording):
    """They are copies: the library uses its memory again."""
    with RealSenseFile(recording) as camera:
        first = camera.read()
        before = first.depth.copy(), first.color.copy()
        while camera.read() is not None:
            pass
    np.testing.assert_array_equal(first.depth, before[0])
    np.testing.assert_array_equal(first.color, before[1])


def test_a_recording_plays_at_its_own_pace_by_name(recording):
    with open_camera(str(recording)) as camera:
        start = time.monotonic()
        stamps = [camera.read().time for _ in range(4)]
        assert time.monotonic() - start > 0.09
    assert abs(stamps[0] - start) < 0.5
    np.testing.assert_allclose(np.diff(stamps), 0.0333, atol=1e-3)


def test_lens_distortion_is_refused(rs, tmp_path):
    path = make_recording(rs, tmp_path / "bent.db3", (150.0, 150.0, 80.0, 60.0, 0.05))
    with pytest.raises(CameraError, match="lens distortion .*use a D435"):
        RealSenseFile(path)


def test_a_recording_without_colour_is_refused(rs, tmp_path):
    path = make_recording(rs, tmp_path / "depth.db3", PLAIN, color=False)
    with pytest.raises(CameraError, match="lacks depth or colour"):
        RealSenseFile(path)


@pytest.fixture(scope="module")
def stereo_recording(rs, tmp_path_factory):
    """With infrared images, of which one is missing, and imagers that do not look in parallel."""
    path = tmp_path_factory.mktemp("rs") / "stereo.db3"
    return make_recording(rs, path, PLAIN, infrared=Infrared(missing=(4,)), turned=TURNED)


def test_beside_the_aligned_pair_comes_what_the_left_imager_saw(stereo_recording):
    with RealSenseFile(stereo_recording) as camera:
        seen = camera.left.intrinsics
        assert (seen.width, seen.height) == (WIDTH, HEIGHT)
        np.testing.assert_allclose((seen.fx, seen.fy, seen.cx, seen.cy), DEPTH_VIEW[:4], rtol=1e-6)
        frames = read_all(camera)
    numbers = [round((frame.time - 1.0) / 0.0333) for frame in frames]
    for k, frame in zip(numbers, frames, strict=True):
        assert frame.left.depth.dtype == np.float32
        np.testing.assert_allclose(frame.left.depth, 0.500 + 0.001 * k, atol=1e-6)  # all of it
        assert (frame.depth == 0).any()  # the colour camera sees beside it
        if k == 4:
            assert frame.left.infrared is None
        else:
            assert frame.left.infrared.dtype == np.uint8
            assert frame.left.infrared.shape == (HEIGHT, WIDTH)
            assert (frame.left.infrared == 30 + k).all()
    assert 4 in numbers and len(numbers) >= COUNT - 2


def test_the_left_imagers_pose_takes_its_points_to_where_the_library_does(rs, stereo_recording):
    point_d = [0.04, -0.03, 0.5]
    expected = rs.rs2_transform_point_to_point(extrinsics(rs, TURNED, [0.015, 0, 0]), point_d)
    with RealSenseFile(stereo_recording) as camera:
        T_cd = camera.left.T_cd
    np.testing.assert_allclose(T_cd.transformFrom(np.array(point_d)), expected, atol=1e-7)
    assert np.linalg.norm(T_cd.transformTo(np.array(point_d)) - expected) > 0.01


def test_infrared_images_change_nothing_of_the_aligned_pair(rs, recording, tmp_path):
    beside = make_recording(rs, tmp_path / "stereo.db3", PLAIN, infrared=Infrared())
    found = []
    for path in (recording, beside):
        with RealSenseFile(path) as camera:
            frames = read_all(camera)
            found.append({round(1000 * frame.time): (frame.depth, frame.color) for frame in frames})
    both = set(found[0]) & set(found[1])
    assert len(both) >= COUNT - 3
    for time_ms in both:
        np.testing.assert_array_equal(found[0][time_ms][0], found[1][time_ms][0])
        np.testing.assert_array_equal(found[0][time_ms][1], found[1][time_ms][1])


def test_a_recording_without_infrared_has_no_left_imager_and_needs_no_warning(recording, caplog):
    with RealSenseFile(recording) as camera:
        assert camera.left is None
        assert camera.read().left is None
    assert caplog.text == ""


@pytest.mark.parametrize(
    ("infrared", "warning"),
    [
        (Infrared(view=(*DEPTH_VIEW[:4], 0.05)), r"or the depth has lens distortion \[0.05"),
        (Infrared(view=(185.0, *DEPTH_VIEW[1:])), "has other intrinsics than the depth: .*185"),
        (Infrared(size=(80, 60)), "has 80 x 60 pixels, the depth 160 x 120"),
        (Infrared(format="y16"), "is of format .*y16, expected 8 bit"),
        (Infrared(index=2), None),  # the right imager's
    ],
)
def test_infrared_images_that_cannot_be_laid_on_the_depth_are_left_out(
    rs, tmp_path, caplog, infrared, warning
):
    path = make_recording(rs, tmp_path / "odd.db3", PLAIN, infrared=infrared)
    with RealSenseFile(path) as camera:
        assert camera.left is None
        frame = camera.read()
    assert frame.left is None and (frame.depth > 0).any()
    if warning is None:
        assert caplog.text == ""
    else:
        (record,) = caplog.records
        assert record.levelname == "WARNING"
        assert re.search(
            f"Soft D435: the infrared image {warning}.*; going on without it$", record.message
        )


def test_a_paced_recording_hands_on_what_the_left_imager_saw(stereo_recording):
    with open_camera(str(stereo_recording)) as camera:
        assert camera.left.intrinsics.fx == pytest.approx(DEPTH_VIEW[0])
        assert camera.read().left.depth.shape == (HEIGHT, WIDTH)


@pytest.fixture
def plug_in(rs, monkeypatch):
    """Has the library find the camera of a recording as if it were plugged in."""
    return lambda path: monkeypatch.setattr(realsense, "_library", connected(rs, path))


def connected(rs, path):
    context = rs.context()
    device = context.load_device(str(path))  # it is there as long as somebody holds it
    plugged_in = {name: getattr(rs, name) for name in dir(rs) if not name.startswith("__")}
    plugged_in |= {"context": lambda: context, "pipeline": lambda: rs.pipeline(context)}
    return lambda: SimpleNamespace(**plugged_in, held=device)


def test_a_camera_streams_infrared_images_too(stereo_recording, plug_in):
    plug_in(stereo_recording)
    with RealSenseCamera(width=WIDTH, height=HEIGHT) as camera:
        assert camera.left.T_cd.translation()[0] == pytest.approx(0.015)
        assert any(camera.read().left.infrared is not None for _ in range(4))


def test_a_camera_that_cannot_stream_infrared_too_goes_on_without(recording, plug_in, caplog):
    plug_in(recording)
    with RealSenseCamera(width=WIDTH, height=HEIGHT) as camera:
        assert camera.left is None
        frame = camera.read()
    assert frame.left is None and (frame.depth > 0).any()
    (record,) = caplog.records
    assert re.search(
        "cannot stream from Soft D435 77 with infrared images: Couldn't resolve requests; use a USB 3 port "
        ".*; going on without infrared images$",
        record.message,
    )


def test_a_file_that_is_no_recording_is_refused(rs, tmp_path):
    (tmp_path / "text.db3").write_text("hello")
    with pytest.raises(CameraError, match="cannot stream from .*text.db3.*is it a RealSense"):
        RealSenseFile(tmp_path / "text.db3")
    with pytest.raises(CameraError, match="there is no RealSense recording"):
        RealSenseFile(tmp_path / "none.db3")


def test_without_a_camera_the_error_comes_at_once(rs):
    if realsense.find_devices():
        pytest.skip("a RealSense camera is connected")
    start = time.monotonic()
    with pytest.raises(CameraError, match=r"no RealSense camera is connected \(found: none\)"):
        RealSenseCamera()
    assert time.monotonic() - start < 5.0  # the library itself would wait for 15 s


def test_without_the_library_the_error_quotes_what_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyrealsense2", None)
    with pytest.raises(CameraError, match=r"pip install pyrealsense2.*libusb-1.0-0"):
        realsense.find_devices()


def device(serial):
    return RealSenseDevice("D435", serial, "5.16", "3.2")


def test_the_camera_is_chosen_by_its_serial_number():
    two = [device("1"), device("2")]
    assert realsense._choose(two, "2").serial == "2"
    assert realsense._choose(two[:1], None).serial == "1"
    with pytest.raises(CameraError, match="more than one .* name a serial"):
        realsense._choose(two, None)
    with pytest.raises(CameraError, match=r"no RealSense camera 3 .*found: D435 1, D435 2"):
        realsense._choose(two, "3")


class Images:
    """Stands for the library's stream: stamps [s] by one clock or the other."""

    name, intrinsics = "stand-in", CameraIntrinsics(2, 1, 1.0, 1.0, 0.0, 0.0)

    def __init__(self, stamps, by_host):
        self._stamps, self._by_host = iter(stamps), by_host

    def next(self, _wait):
        stamp = next(self._stamps, None)
        frame = None if stamp is None else CameraFrame(stamp, np.zeros((1, 2)), None)
        return None if frame is None else (frame, self._by_host)


def live_camera(stream, clock):
    camera = RealSenseCamera.__new__(RealSenseCamera)
    camera._stream, camera._clock = stream, clock
    camera._device_clock = realsense.DeviceClock()
    camera.name = stream.name
    return camera


def test_wall_clock_stamps_become_monotonic_ones():
    taken = time.time() - 0.040
    frame = live_camera(Images([taken], by_host=True), time.monotonic).read()
    assert time.monotonic() - frame.time == pytest.approx(0.040, abs=0.02)


def test_stamps_by_the_camera_s_own_clock_become_monotonic_ones():
    arrivals = iter([50.010, 50.050, 50.080])  # late by 10, 17, 14 ms
    camera = live_camera(Images([7.0, 7.033, 7.066], by_host=False), lambda: next(arrivals))
    stamps = [camera.read().time for _ in range(3)]
    np.testing.assert_allclose(stamps, [50.010, 50.043, 50.076], atol=1e-9)


def test_a_camera_that_falls_silent_is_an_error():
    with pytest.raises(CameraError, match="stand-in: no image for 2 s; is it still plugged in"):
        live_camera(Images([], by_host=True), time.monotonic).read()


class FakeFrame:
    """A frame of the library, or the false one that stands for a missing frame."""

    def __init__(self, there=True, stamp=1000.0):
        self.there, self.stamp = there, stamp

    def __bool__(self):
        return self.there

    def get_timestamp(self):
        return self.stamp

    def get_frame_timestamp_domain(self):
        return "system"

    def get_data(self):
        return np.ones((2, 2))


class FakeFrames:
    def __init__(self, depth, color):
        self.depth, self.color = FakeFrame(depth), FakeFrame(color)

    def get_depth_frame(self):
        return self.depth

    def get_color_frame(self):
        return self.color

    def get_infrared_frame(self, index):
        assert index == 1  # the left one
        return self.infrared


def fake_stream(sets, imager=None):
    """A stream whose pipeline gives these sets of frames (whether depth and colour are there)."""
    stream = realsense._Stream.__new__(realsense._Stream)
    left = [FakeFrames(*present) for present in sets]

    class Pipeline:
        def __init__(self):
            self.left = left

        def try_wait_for_frames(self, wait):
            return (True, left.pop(0)) if left else (False, None)

    class Library:
        class timestamp_domain:
            hardware_clock = "hardware"

    class Align:
        def process(self, frames):
            return frames

    stream._pipeline, stream._rs, stream._align = Pipeline(), Library, Align()
    stream._depth_unit, stream.name, stream.left = 0.001, "D435", imager
    return stream


def test_sets_that_lack_an_image_are_passed_over():
    stream = fake_stream([(True, False), (False, True), (False, False), (True, True)])
    frame, _ = stream.next(1.0)
    assert frame.time == 1.0
    assert frame.depth.shape == frame.color.shape == (2, 2)
    assert frame.left is None
    assert stream.next(0.1) is None


@pytest.mark.parametrize(
    ("late", "used"), [(0.0, True), (3.0, True), (-11.1, False), (33.3, False), (None, False)]
)
def test_an_infrared_image_of_another_instant_than_the_depth_is_not_used(late, used):
    """The library repeats a stream's last image where the next one is late; the shortest period is 11 ms."""
    stream = fake_stream(
        [(True, True)], imager=LeftImager(CameraIntrinsics(2, 2, 1, 1, 0, 0), POSE)
    )
    frames = stream._pipeline.left[0]
    frames.infrared = FakeFrame(late is not None, 1000.0 + (late or 0.0))
    frame, _ = stream.next(1.0)
    assert frame.left.depth.shape == (2, 2)  # as it was measured, with or without
    assert (frame.left.infrared is not None) == used


def test_an_unplugged_camera_is_a_camera_error():
    stream = fake_stream([])

    def gone(wait):
        raise RuntimeError("Device disconnected")

    stream._pipeline.try_wait_for_frames = gone
    with pytest.raises(CameraError, match="D435: Device disconnected"):
        stream.next(0.1)


def test_stamps_by_a_wall_clock_that_was_set_are_told_in_this_computers_time():
    """The library stamps by the host's wall clock; somebody sets that by 5 s."""
    camera = RealSenseCamera.__new__(RealSenseCamera)
    now, ahead = [100.0], 5.0
    camera._clock = lambda: now[0]
    camera._device_clock, camera.name = realsense.DeviceClock(), "D435"
    stamps = iter(())

    class Stream:
        def next(self, wait):
            now[0] += 1 / 30
            return CameraFrame(next(stamps), np.zeros((1, 1)), None), True

    camera._stream = Stream()
    taken = []
    stamps = iter([time.time() - ahead - 0.03 + k / 30 for k in range(30)])
    for _ in range(30):
        taken.append(now[0] + 1 / 30 - camera.read().time)
    assert max(np.abs(taken)) < 0.1  # [s], where the stamp says 5 s
