# SPDX-License-Identifier: MIT
"""A live run from the open hand to the end of the grasp.

    open the hand, try its joints -> compare it with the camera's image -> baseline of the pads
    -> put the object on the palm -> find it -> close the hand -> track and record

The main thread only watches: it asks, prints the status, ends the run when a thread fails or a stream falls
silent, and is where signals arrive. It watches while a person is asked as well. Whatever ends the run, the torque
goes off first.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from datetime import UTC, datetime

import gtsam

from hardware.camera.camera import Camera
from hardware.camera.hand_view import check_hand_view
from hardware.camera.imager import LeftImager
from hardware.device import HandDevice, PadDevice
from vtgtsam import Calibration, PoseEstimator
from vtgtsam.calibration.online import OnlineCalibration
from vtgtsam.calibration.sources import run_of
from vtgtsam.exceptions import LiveError
from vtgtsam.live.calibrating import instant_ns, kept
from vtgtsam.live.clock import RunClock
from vtgtsam.live.fusion import Estimator, Fusion, vision_hold
from vtgtsam.live.inputs import Inputs
from vtgtsam.live.recorder import Recorder
from vtgtsam.live.threads import Workers
from vtgtsam.live.view import LiveView, Setup
from vtgtsam.vision.depth_tracker import DepthTracker
from vtgtsam.vision.first_pose import Candidate
from vtgtsam.vision.hand_back import BACK, pose_to_search_at

from .ages import ages, check_ages
from .calibrating import robot_of
from .devices import Devices
from .find import PLACING, as_start, find_object, still_image, wait_for_object
from .fingers import Fingers, Phase
from .opening import wait_until_open
from .person import Ask, Person
from .plan import Plan
from .recording import open_recording
from .sensors import Pads, Vision
from .status import Status
from .tracking import run_tracker
from .warm_up import warm_up

HOLD = 2.0  # [s], the closed hand is watched for so long before an emulated run ends
_SWITCH = (
    0.0005  # [s], after which a computing thread lets others in; Python's 5 ms make ticks late
)
_GLANCE = 0.1  # [s], how often the main thread looks


def carry_out(plan: Plan, devices: Devices, ask: Ask | None, say: Callable[[str], None]) -> Status:
    """Carry a plan out; returns when it is done.

    Args:
        plan: What to do.
        devices: With what.
        ask: Asks a person; None: nobody is asked, what has to be done is waited for.
        say: Shows a line.

    Raises:
        VtgtsamError: Something failed; the torque is off unless the message says otherwise.
    """
    sys.setswitchinterval(_SWITCH)
    return _Session(plan, devices, ask, say).carry_out()


class _Session:
    """The parts of one run."""

    def __init__(
        self,
        plan: Plan,
        devices: Devices,
        ask: Ask | None,
        say: Callable[[str], None],
    ) -> None:
        self._plan, self._devices = plan, devices
        self._person = Person(ask, say, needed=devices.put_object is None)
        self._clock = RunClock()
        self._started = datetime.now(UTC).isoformat(timespec="seconds")
        self._recorder = Recorder(None)
        self._estimator: Estimator = PoseEstimator(
            plan.hand, plan.obj, plan.config, plan.calibration
        )
        self._inputs = self._make_inputs()
        self._view: LiveView | None = None
        self._fusion: Fusion | None = None

    def carry_out(self) -> Status:
        """From opening the devices to the summary."""
        plan = self._plan
        with ExitStack() as stack:
            camera = stack.enter_context(self._devices.open_camera(self._show_truth))
            if plan.view is not None:
                setup = Setup(
                    *(plan.hand, plan.obj, self._devices.T_ch, camera.intrinsics),
                    camera_is_world=True,
                    truth=self._devices.lost is not None,
                )
                self._view = stack.enter_context(LiveView(plan.view, setup))
            self._know_camera(camera.name, stack)
            tracker, imager = run_tracker(plan, camera)
            infrared = imager is not None
            warm_up(plan.hand, plan.obj, tracker, self._estimator, self._devices.T_ch, infrared)
            pads = stack.enter_context(self._devices.open_pads())
            self._clock = RunClock()
            hold, emulated = vision_hold(self._estimator), self._devices.lost is not None
            writer = open_recording(plan, camera.name, self._started, hold, emulated, infrared)
            self._recorder = stack.enter_context(Recorder(writer))
            self._inputs = self._make_inputs()
            workers = stack.enter_context(Workers())
            # The last to come in is the first to go out: the torque.
            device = stack.enter_context(self._devices.open_hand())
            stack.callback(workers.stop.set)
            self._recorder.write("camera_pose", 0, gtsam.Pose3())
            self._recorder.write("camera_info", 0, camera.intrinsics)
            self._inputs.put_hand_pose(0, self._devices.T_ch)
            fingers = self._open(device, workers)
            self._compare_with_image(camera, fingers)
            self._start_pads(pads, workers)
            tracker.start(self._first_pose(camera, fingers, workers))
            vision = self._start_vision(camera, tracker, imager, workers)
            fusion = self._start_fusion(workers)
            status = Status(self._inputs, fusion, fingers, vision, self._clock)
            if self._view is not None:
                self._view.watch(
                    *(self._inputs, fusion, self._clock.now_ns),
                    *(lambda: vision.frame, lambda: status.last_line),
                )
            fingers.close()
            self._watch(status, fingers, workers)
        self._person.say("torque is off")
        status.remarks = [
            *device.remarks(),
            *pads.remarks(),
            *vision.remarks(),
            *self._recorder.remarks(),
        ]
        if isinstance(self._estimator, OnlineCalibration):
            runs = [] if plan.record is None else [run_of({"started": self._started})]
            status.remarks.append(kept(self._estimator, runs, plan.calibration_out))
        if not fusion.count:
            raise LiveError("; ".join([_why_no_pose(vision), *status.remarks]))
        return status

    def _know_camera(self, name: str, stack: ExitStack) -> None:
        """Refuse a calibration of another camera, and begin to calibrate this one where that is wanted."""
        plan = self._plan
        robot = robot_of(plan.hand, name, plan.calibration)
        if plan.calibrate:
            online = OnlineCalibration(
                plan.hand,
                plan.obj,
                plan.config,
                plan.calibration,
                robot,
                on_change=self._recalibrated,
            )
            self._estimator = stack.enter_context(online)

    def _recalibrated(self, time: float, calibration: Calibration) -> None:
        self._recorder.write("calibration", instant_ns(time), calibration)

    def _make_inputs(self) -> Inputs:
        return Inputs(
            self._plan.hand.joint_names,
            self._plan.hand.pad_names,
            self._clock.now_ns,
            self._recorder,
            hold_ns=round(1e9 * vision_hold(self._estimator)),
            hand_moves=True,
        )

    def _open(self, device: HandDevice, workers: Workers) -> Fingers:
        """Torque on, hand open, every joint tried."""
        plan = self._plan
        self._request("The hand will move. Keep away from it, then press Enter: ", workers)
        device.configure()
        device.enable()
        fingers = Fingers(device, plan.hand, plan.grasp, self._inputs, self._clock)
        workers.start("hand", fingers.run)
        wait_until_open(fingers, workers.check)
        return fingers

    def _request(self, text: str, workers: Workers) -> None:
        """Have a person do something, and watch hand and threads meanwhile."""

        def watch() -> None:
            workers.check()
            if self._inputs.count("joints"):
                joints = self._inputs.age("joints", self._clock.now_ns())
                check_ages({"joints": joints}, self._plan.give_up)

        self._person.request(text, watch)

    def _compare_with_image(self, camera: Camera, fingers: Fingers) -> None:
        """See that the hand is where joints and wrist calibration put it, before anything depends on it."""
        depth, joints = still_image(camera), fingers.joints
        assert joints is not None  # the hand is open
        self._person.say(
            check_hand_view(depth, camera.intrinsics, self._plan.hand, joints, self._devices.T_ch)
        )

    def _start_pads(self, device: PadDevice, workers: Workers) -> None:
        self._request("Nothing may touch the pads now. Press Enter: ", workers)
        if found := device.prepare():
            self._person.say(found)
        pad_names = self._plan.hand.pad_names
        pads = Pads(device, pad_names, self._inputs, self._clock)
        workers.start("pads", pads.run)

    def _first_pose(self, camera: Camera, fingers: Fingers, workers: Workers) -> gtsam.Pose3:
        """T_co of the object on the open hand, once it lies there."""
        plan, T_ch, say = self._plan, self._devices.T_ch, self._person.say
        if self._devices.put_object is not None:
            self._devices.put_object()
        else:
            self._request(
                f"Put {plan.obj.name} on the palm, take your hands away, then press Enter: ",
                workers,
            )
        if plan.T_ho is not None:
            return T_ch * plan.T_ho

        def find() -> Candidate:
            joints = fingers.joints
            assert joints is not None  # the hand is open
            return find_object(camera, plan.obj, plan.hand, joints, T_ch)

        if self._person.needed and self._person.ask is None:
            say(
                f"waiting for up to {PLACING:.0f} s until the camera sees {plan.obj.name} lie still"
            )
            found = wait_for_object(find, plan.obj, workers.check)
        else:
            found = find()
        say(
            f"found {plan.obj.name} at --start {as_start(found, T_ch)}, which explains "
            f"{100 * found.score:.0f} % of what is seen"
        )
        return found.T_co

    def _start_vision(
        self, camera: Camera, tracker: DepthTracker, imager: LeftImager | None, workers: Workers
    ) -> Vision:
        vision = Vision(
            camera,
            tracker,
            self._devices.T_ch,
            self._inputs,
            self._clock,
            self._plan.images,
            lambda: self._estimator.calibration,
            self._hint,
            imager,
        )
        workers.start("vision", vision.run)
        return vision

    def _hint(self, seen: bool) -> gtsam.Pose3 | None:
        """The fused pose, where the tracker is to be told and has lost itself.

        Most frames have no visual pose of their own, so that it counts whether the tracker saw the object last.
        """
        last = None if self._fusion is None else self._fusion.last
        if last is None or not self._plan.tracker.endswith(BACK):
            return None
        if seen and last.status != "contradicted":
            return None
        return pose_to_search_at(last)

    def _start_fusion(self, workers: Workers) -> Fusion:
        self._fusion = fusion = Fusion(self._inputs, self._estimator, self._clock.now_ns)
        workers.start("fusion", fusion.run)
        return fusion

    def _watch(self, status: Status, fingers: Fingers, workers: Workers) -> None:
        """Show how it goes until it is over."""
        start = time.monotonic()
        closed: float | None = None
        try:
            while not workers.stop.wait(_GLANCE):
                now_ns, elapsed = self._clock.now_ns(), time.monotonic() - start
                check_ages(ages(self._inputs, now_ns), self._plan.give_up)
                self._recorder.check()
                status.show()
                if fingers.phase is Phase.CLOSED and closed is None:
                    closed = elapsed
                if self._plan.seconds is not None and elapsed >= self._plan.seconds:
                    return
                if self._plan.ends_after_grasp and closed is not None and elapsed > closed + HOLD:
                    return
            workers.check()
        finally:
            status.end()

    def _show_truth(self, monotonic: float, T_co: gtsam.Pose3) -> None:
        """The camera's frame is the world."""
        instant_ns = self._clock.instant_ns(monotonic)
        if instant_ns >= 0:
            self._recorder.write("truth", instant_ns, T_co)
            if self._view is not None:
                self._view.truth(instant_ns, T_co)


def _why_no_pose(vision: Vision) -> str:
    """Why a run gave no estimate."""
    if vision.trouble or vision.odd_stamps:
        return "no estimate, as no image could be used"
    return (
        f"no estimate: the tracker never saw the object, in none of {vision.lost} images. Is it where it was found, or "
        "where --start says?"
    )
