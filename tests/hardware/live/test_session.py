# SPDX-License-Identifier: MIT
"""Whole runs in this process: emulated servos that drive free motors, and a camera that renders hand and can."""

from __future__ import annotations

import dataclasses
import threading
import time
from dataclasses import dataclass, field

import gtsam
import numpy as np
import pytest

from hardware.camera.camera import Camera, CameraError, CameraFrame
from hardware.camera.imager import LeftImager, LeftImages
from hardware.device import PadDevice, PadState
from hardware.emulate.servo import OVERLOAD
from hardware.emulate.servos import ServoLineEmulator
from hardware.live.calibrating import as_seen
from hardware.live.devices import Devices, load_hand_and_grasp
from hardware.live.fingers import Phase
from hardware.live.plan import Plan
from hardware.live.sensors import NoPads
from hardware.live.session import carry_out
from hardware.servo.bus import ServoError
from hardware.servo.description import load_description
from hardware.servo.hand import Hand
from vtgtsam import Calibration, EstimatorConfig, load_object, read_recording
from vtgtsam.calibration.robot import Robot
from vtgtsam.camera import CameraIntrinsics
from vtgtsam.exceptions import LiveError, VtgtsamError
from vtgtsam.live.replay import replay
from vtgtsam.offsets import CalibrationPrior
from vtgtsam.recording.camera import camera_intrinsics, depth_images
from vtgtsam.vision.alignment import Evidence, Shape
from vtgtsam.vision.hand_mask import HandMask
from vtgtsam.vision.view import View

DESCRIPTION = load_description("isyhand").model_copy(update={"watchdog": 2.0, "patience": 0.3})
HAND, GRASP = load_hand_and_grasp(DESCRIPTION)
CAMERA = CameraIntrinsics(160, 120, 154.0, 154.0, 79.5, 59.5)
DOWN = np.arctan2(0.32, 0.31)  # [rad], the camera looks down at the hand by this angle
R_CH = np.array(
    [[0, -1, 0], [-np.sin(DOWN), 0, -np.cos(DOWN)], [np.cos(DOWN), 0, -np.sin(DOWN)]], dtype=float
)
T_CH = gtsam.Pose3(gtsam.Rot3(R_CH), np.array([0.01, 0.02, 0.45]))
T_HO = gtsam.Pose3(gtsam.Rot3(), np.array([0.09, 0.05, 0.20]))  # in sight, out of the fingers' way


@pytest.fixture(scope="module")
def can():
    return load_object("can")


def rendered_can(can, camera, T_ch):
    """Depth of the can alone [m], inf beside it."""
    nothing = np.zeros((camera.height, camera.width))
    view = View(nothing, nothing > 0, camera, sigma=0.001)
    return Evidence(Shape(can.sdf), view, T_ch * T_HO).predicted


class Scene(Camera):
    """Renders the hand at its servos' angles, and the can, 20 times a second.

    Attributes:
        silent: Raise instead, as a camera does that was unplugged.
        blind: Leave the can out.
        late: By how much stamps lie in the past [s].
    """

    def __init__(self, line, can):
        self.name, self.intrinsics = "scene", CAMERA
        self.silent, self.blind, self.late = False, False, 0.0
        self._line, self._mask = line, HandMask(HAND)
        self._can = rendered_can(can, CAMERA, T_CH)

    def read(self):
        time.sleep(0.05)
        if self.silent:
            raise CameraError("scene: no image for 2 s; is it still plugged in?")
        hand = self.hand_depth(CAMERA, T_CH)
        depth = np.minimum(hand, np.inf if self.blind else self._can)
        depth = np.where(np.isfinite(depth), depth, 1.2).astype(np.float32)
        return CameraFrame(time.monotonic() - self.late, depth, None)

    def hand_depth(self, camera, T_ch):
        """Depth of the hand alone [m], inf beside it."""
        angles = {
            j.name: j.angle(self._line.servos[j.id].get("present_position"))
            for j in DESCRIPTION.joints
        }
        return self._mask.depth(camera, T_ch.inverse(), angles)

    def close(self):
        pass


class StereoScene(Scene):
    """The same with a left imager that looks from beside; its infrared image has a bright can."""

    def __init__(self, line, can):
        super().__init__(line, can)
        intrinsics = CameraIntrinsics(150, 130, 140.0, 140.0, 74.5, 64.5)
        T_cd = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.02, 0.04, -0.03), np.array([-0.015, 0.0, 0.0]))
        self.left = LeftImager(intrinsics, T_cd)
        self._T_dh = T_cd.inverse() * T_CH
        self._left_can = rendered_can(can, intrinsics, self._T_dh)

    def read(self):
        frame = super().read()
        hand = self.hand_depth(self.left.intrinsics, self._T_dh)
        depth = np.minimum(hand, self._left_can)
        infrared = np.full(depth.shape, 25, dtype=np.uint8)
        infrared[np.isfinite(hand)], infrared[self._left_can < hand] = 60, 120
        depth = np.where(np.isfinite(depth), depth, 1.2).astype(np.float32)
        return dataclasses.replace(frame, left=LeftImages(depth, infrared))


@dataclass
class StillPads(PadDevice):
    """Pads that nothing touches; remembers that it was prepared."""

    prepared: list = field(default_factory=list)

    def prepare(self):
        self.prepared.append(time.monotonic())
        return "baseline measured"

    def since(self, instant):
        now = time.monotonic()
        state = PadState(np.zeros(len(HAND)), np.zeros(len(HAND), dtype=bool))
        return [(now, state)] if now > instant + 0.02 else []

    def close(self):
        pass


@pytest.fixture
def line():
    with ServoLineEmulator(joint.id for joint in DESCRIPTION.joints) as emulator:
        yield emulator


class Bench:
    """What a run needs, and what it said."""

    def __init__(self, line, can, description=DESCRIPTION, pads=None):
        self.line, self.camera, self.pads = line, Scene(line, can), pads or StillPads()
        self.said, self.can, self.description = [], can, description

    def run(self, ask=None, T_ch=T_CH, put=lambda: None, **changes):
        devices = Devices(
            open_hand=lambda: Hand(self.description, self.line.path),
            open_pads=lambda: self.pads,
            open_camera=lambda truth: self.camera,
            T_ch=T_ch,
            put_object=put,
        )
        config = EstimatorConfig.tuned()
        changes = {"seconds": 1.0, "give_up": 5.0, **changes}
        plan = Plan(HAND, GRASP, self.can, config, T_ho=T_HO, **changes)
        return carry_out(plan, devices, ask, self.said.append)

    def all_off(self):
        return not any(servo.torque for servo in self.line.servos.values())


@pytest.fixture
def bench(line, can):
    return Bench(line, can)


def later(seconds, work):
    timer = threading.Timer(seconds, work)
    timer.daemon = True
    timer.start()


def when_closing(bench, work, after=0.5):
    """Do something while the fingers close: the pads are prepared shortly before."""

    def wait():
        while not bench.pads.prepared:
            time.sleep(0.02)
        time.sleep(after)
        work()

    threading.Thread(target=wait, daemon=True).start()


def test_a_run_compares_measures_and_tracks(bench):
    status = bench.run()
    assert bench.all_off()
    assert status._fusion.count > 10
    assert status._fingers.phase in (Phase.CLOSING, Phase.CLOSED)
    assert len(bench.pads.prepared) == 1  # also where nobody is asked
    assert any("the depth image shows the hand 0." in line for line in bench.said)
    assert status.remarks == []


def test_a_hand_of_xc330s_without_pads_runs_by_its_file_alone(can):
    content = DESCRIPTION.model_dump() | {"servo": "XC330-M288-T", "baud": 4_000_000, "pads": None}
    content["joints"] = sorted(content["joints"], key=lambda joint: joint["id"])
    checked = type(DESCRIPTION).model_validate(content | {"patience": 0.1})
    description = checked.model_copy(update={"patience": DESCRIPTION.patience})
    ids = [joint.id for joint in description.joints]
    with ServoLineEmulator(ids, description.baud, model=description.servo) as line:
        bench = Bench(line, can, description, NoPads(len(HAND)))
        status = bench.run()
        assert bench.all_off()
    assert status._fusion.count > 10
    assert status._fusion.last.T_wo is not None
    assert any("no pads" in text for text in bench.said)


def test_a_camera_that_falls_silent_leaves_touch_and_says_so(bench):
    when_closing(bench, lambda: setattr(bench.camera, "silent", True), after=0.8)
    status = bench.run(seconds=2.0)
    assert status._fusion.last.T_wo is not None  # the object is not dropped
    assert status._vision.trouble == "scene: no image for 2 s; is it still plugged in?"
    assert any(remark.startswith("no images for ") for remark in status.remarks)
    assert any("note: no images" in line for line in status.summary())


def test_a_run_with_a_left_imager_tracks_in_its_images_and_records_the_aligned_ones(
    line, can, tmp_path
):
    bench, path = Bench(line, can), tmp_path / "run.mcap"
    bench.camera = StereoScene(line, can)
    status = bench.run(record=path)
    assert bench.all_off()
    assert status.remarks == [] and status._vision.lost < status._vision.images / 2
    T_co = status._fusion.last.T_wo
    assert np.linalg.norm(T_co.translation() - (T_CH * T_HO).translation()) < 0.002
    recording = read_recording(path)
    assert recording.info["infrared"] == "yes"
    for estimate in replay(recording):
        assert recording.estimates.at([estimate.time])[0].equals(estimate.T_wo, 1e-9)
    depths = [image for _, image in depth_images(path)]
    assert depths and all(image.shape == (CAMERA.height, CAMERA.width) for image in depths)
    assert camera_intrinsics(path) == CAMERA


@pytest.mark.slow  # a whole run
def test_a_run_without_a_first_visual_pose_is_an_error_with_a_reason(bench):
    bench.camera.blind = True
    with pytest.raises(
        LiveError, match=r"no estimate: the tracker never saw the object, in none of \d+ images"
    ):
        bench.run(tracker="depth")  # one that knows the hand carries the first pose with it
    assert bench.all_off()


@pytest.mark.slow  # a whole run
def test_stamps_from_the_past_are_the_reason_that_is_told(bench):
    bench.camera.late = 0.0
    when_closing(bench, lambda: setattr(bench.camera, "late", 5.0), after=0.0)
    try:
        remarks = bench.run().remarks
    except LiveError as error:  # where they began before the first pose
        remarks = [str(error)]
    assert any("by their stamps they are from 5.0 s ago; did a clock jump?" in r for r in remarks)


def test_a_wrong_wrist_calibration_is_refused_before_the_object_is_asked_for(bench):
    T_off = gtsam.Pose3(gtsam.Rot3(), np.array([0.0, 0.0, 0.022])) * T_CH
    with pytest.raises(CameraError, match="from where the wrist calibration"):
        bench.run(T_ch=T_off)
    assert bench.pads.prepared == []
    assert bench.all_off()


def test_a_stuck_encoder_is_not_believed(bench):
    servo = bench.line.servos[12]
    observe = servo.observe
    stuck = servo.get("present_position")

    def frozen(motion):
        observe(motion)
        servo.set("present_position", stuck)

    servo.observe = frozen
    with pytest.raises(LiveError, match="index_middle reads as if it stood still: is it caught"):
        bench.run()
    assert bench.all_off()


def test_an_encoder_that_sticks_while_the_hand_closes_is_named(bench):
    def stick():
        with bench.line.lock:
            bench.line.servos[12].stuck = True

    when_closing(bench, stick)
    with pytest.raises(
        ServoError, match=r"index_middle \(servo 12\) reads .* its encoder is stuck"
    ):
        bench.run()
    assert bench.all_off()


def test_somebody_watches_while_a_person_is_asked(bench):
    asked = []

    def ask(question, watch):
        asked.append(question)
        if "Nothing may touch" in question:
            with bench.line.lock:
                bench.line.servos[33].fail(OVERLOAD)
            end = time.monotonic() + 10
            while time.monotonic() < end:  # the person does not come back
                watch()
                time.sleep(0.05)

    start = time.monotonic()
    with pytest.raises(ServoError, match=r"middle_proximal \(servo 33\) reports overload"):
        bench.run(ask=ask, put=None)
    assert len(asked) == 2
    assert time.monotonic() - start < 60
    assert bench.all_off()


@pytest.mark.slow  # a whole run
def test_without_questions_it_waits_until_the_object_lies_there(bench, monkeypatch):
    bench.camera.blind = True
    finds = iter([LiveError("not yet"), LiveError("not yet"), T_HO, T_HO])

    def find(camera, obj, hand, joints, T_ch):
        found = next(finds)
        if isinstance(found, LiveError):
            raise found
        bench.camera.blind = False
        from vtgtsam.vision.first_pose import Candidate

        return Candidate(T_ch * found, 1.0, 0.0)

    monkeypatch.setattr("hardware.live.session.find_object", find)
    devices_put = None
    plan_pose = {"T_ho": None}
    config = EstimatorConfig.tuned()
    devices = Devices(
        open_hand=lambda: Hand(DESCRIPTION, bench.line.path),
        open_pads=lambda: bench.pads,
        open_camera=lambda truth: bench.camera,
        T_ch=T_CH,
        put_object=devices_put,
    )
    plan = Plan(HAND, GRASP, bench.can, config, seconds=1.0, give_up=5.0, **plan_pose)
    carry_out(plan, devices, None, bench.said.append)
    assert list(finds) == []
    assert len(bench.pads.prepared) == 1
    assert any("waiting for up to 60 s" in line for line in bench.said)


def test_a_recording_that_cannot_be_written_is_an_error_in_words(bench, tmp_path):
    class Full:
        path = tmp_path / "out.mcap"

        def __getattr__(self, name):
            def refuse(*values):
                raise OSError(28, "No space left on device")

            return refuse

    from hardware.live import recording

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(recording, "RecordingWriter", lambda *a, **k: Full())
        with pytest.raises(VtgtsamError, match=r"cannot go on writing .*out.mcap: No space left"):
            bench.run(record=tmp_path / "out.mcap")
    assert bench.all_off()


def calibration(camera):
    """A robot whose thumb turns by half a degree less than its servo says."""
    robot = Robot(HAND.name, HAND.joint_names, camera, gtsam.Pose3())
    units = HAND.zero_units
    P = CalibrationPrior.of_config(EstimatorConfig(), units, np.zeros(3)).covariance
    zeros = dict.fromkeys(HAND.joint_names, 0.0) | {"thumb_rotation": np.deg2rad(0.5)}
    return Calibration(robot, np.zeros(6), T_CH.translation(), zeros, P / 4)


@pytest.mark.slow  # online calibration and replay are tested by themselves
def test_a_run_that_calibrates_records_what_it_corrected_with_and_can_be_replayed(bench, tmp_path):
    known, path = calibration("scene"), tmp_path / "run.mcap"
    kept = tmp_path / "kept.yaml"
    status = bench.run(
        calibration=known, calibrate=True, calibration_out=kept, record=path, images=False
    )
    assert bench.all_off()
    nothing = f"nothing was learnt of camera and joints: {kept} is not written"  # nothing touches
    assert status.remarks[-1] == nothing and not kept.exists()
    recording = read_recording(path)
    assert recording.info["camera"] == "scene"
    assert recording.calibrations.first.joint_zeros == known.joint_zeros
    recorded = recording.estimates
    for estimate in replay(recording):
        T_wo = recorded.at([estimate.time])[0]
        assert T_wo.equals(estimate.T_wo, 1e-9)


def test_a_calibration_of_another_camera_is_refused_before_there_is_torque(bench):
    with pytest.raises(VtgtsamError, match="of camera 'other', not of 'scene'"):
        bench.run(calibration=calibration("other"))
    assert bench.all_off() and not bench.pads.prepared


def test_the_tracker_is_given_the_hand_as_the_camera_sees_it():
    known = calibration("scene")
    joints = np.full(len(HAND.joint_names), 0.2)
    seen, T_ch = as_seen(known, joints, T_CH)
    np.testing.assert_array_equal(seen, joints - known.zeros)
    assert T_ch.equals(T_CH, 1e-12)  # its camera is where it is believed to be
    off = dataclasses.replace(known, camera=np.array([0, 0, 0, 0.002, 0, 0]))
    moved = as_seen(off, joints, T_CH)[1].translation() - T_CH.translation()
    np.testing.assert_allclose(moved, [0.002, 0, 0], atol=1e-12)
    assert as_seen(None, joints, T_CH) == (joints, T_CH)
