# SPDX-License-Identifier: MIT
"""The run in Rerun while it goes on, in the scene that ``vtgtsam view`` draws recordings in.

A viewer may be slow, frozen or gone, and then Rerun's own calls block for good. So the drawing is done
in a process of its own. A thread here takes the newest values ten times a second and hands them over;
while they are not taken off its hands it waits, and nobody waits for it: what comes meanwhile is never
drawn. Devices and estimator do not know of it.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

import gtsam
import numpy as np

from hardware.camera.camera import CameraFrame
from vtgtsam import Estimate, HandModel, ObjectModel
from vtgtsam.camera import CameraIntrinsics
from vtgtsam.live.clock import RunClock
from vtgtsam.live.fusion import Fused, Fusion
from vtgtsam.live.inputs import Inputs
from vtgtsam.live.threads import Ticker

if TYPE_CHECKING:
    from vtgtsam.viz.frame import FrameDrawing
    from vtgtsam.viz.scene import Scene

log = logging.getLogger(__name__)

RATE = 10.0  # [Hz]
_END = 10.0  # [s], for the last values to be written; by then the torque is off
_TRUTHS = 64  # kept, two seconds
_RECENT_NS = 100_000_000  # between an image and a frame, for the true pose of the one to be that of the other
_NICE = 5  # the hand goes first


@dataclass(frozen=True)
class Where:
    """Where to show a run.

    Attributes:
        spawn: Whether to open a viewer; it stays open after the run.
        save: Rerun's file to write, .rrd, or None.
    """

    spawn: bool = False
    save: Path | None = None

    def check(self) -> None:
        """Find out before the hand moves.

        Raises:
            VtgtsamError: Rerun or a display is missing, or the file cannot be written.
        """
        from vtgtsam.viz.stream import check_display, check_writable

        if self.spawn:
            check_display()
        if self.save is not None:
            check_writable(self.save)


@dataclass(frozen=True, eq=False)
class Setup:
    """What does not change in a run.

    Attributes:
        hand: The hand.
        obj: The object.
        T_wh: Pose of the hand in the world, which is the camera's frame.
        intrinsics: The camera's.
    """

    hand: HandModel
    obj: ObjectModel
    T_wh: gtsam.Pose3
    intrinsics: CameraIntrinsics


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The newest values at one instant.

    Attributes:
        time: The estimate's instant, or the present where there is no new one [s].
        joints: Joint angles [rad].
        contacts: Contact bits, shape (K,).
        estimate: The newest estimate; None where there is none since the last snapshot.
        T_wo_visual: What the tracker said of the image that the frame took.
        T_wo_true: The true pose in the last image, where an emulator knows it.
        frame: The newest images.
    """

    time: float
    joints: np.ndarray
    contacts: np.ndarray
    estimate: Estimate | None
    T_wo_visual: gtsam.Pose3 | None
    T_wo_true: gtsam.Pose3 | None
    frame: CameraFrame | None


class LiveView:
    """Shows a run; a context manager. Nothing that happens to the viewer is an error of the run.

    Args:
        where: Where to show it, checked before.
        setup: What does not change.

    Attributes:
        shown: Snapshots handed over so far.
    """

    def __init__(self, where: Where, setup: Setup) -> None:
        self.shown = 0
        self._pads = len(setup.hand)
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._last: Fused | None = None
        self._truth: OrderedDict[int, gtsam.Pose3] = OrderedDict()  # by instant
        context = multiprocessing.get_context("spawn")
        taken, self._given = context.Pipe(duplex=False)
        self._process = context.Process(
            target=_draw, args=(taken, where, setup), name="view", daemon=True
        )
        self._process.start()
        taken.close()

    def __enter__(self) -> LiveView:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def watch(
        self,
        inputs: Inputs,
        fusion: Fusion,
        clock: RunClock,
        frame: Callable[[], CameraFrame | None],
    ) -> None:
        """Begin to show; ``frame`` gives the camera's newest images."""

        def run() -> None:
            ticker = Ticker(RATE)
            while ticker.wait(self._stop):
                snapshot = self._snapshot(inputs, fusion, clock, frame())
                if snapshot is not None and not self._hand_over(snapshot):
                    return

        self._thread = threading.Thread(target=run, name="view", daemon=True)
        self._thread.start()

    def truth(self, instant_ns: int, T_wo: gtsam.Pose3) -> None:
        """The object's true pose at an image's instant, from whoever knows it."""
        self._truth[instant_ns] = T_wo
        while len(self._truth) > _TRUTHS:
            self._truth.popitem(last=False)

    def _truth_at(self, instant_ns: int) -> gtsam.Pose3 | None:
        """The true pose of the last image before an instant, if that was just now."""
        for stamp_ns in reversed(list(self._truth)):
            if stamp_ns <= instant_ns:
                recent = instant_ns - stamp_ns < _RECENT_NS
                return self._truth[stamp_ns] if recent else None
        return None

    def close(self) -> None:
        """Let it write what it has, for a moment, and end it."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(_END)
        if self._thread is None or not self._thread.is_alive():
            self._given.close()  # its end of file
            self._process.join(_END)
        if self._process.is_alive():
            log.warning("the viewer does not answer; what it shows is not complete")
            self._process.kill()

    def _snapshot(
        self, inputs: Inputs, fusion: Fusion, clock: RunClock, frame: CameraFrame | None
    ) -> Snapshot | None:
        """The last frame where it is a new one, else joints and contacts as they are."""
        latest = None if fusion.latest is self._last else fusion.latest
        self._last = fusion.latest
        if latest is not None:
            seen = latest.cut.visual
            return Snapshot(
                time=latest.estimate.time,
                joints=latest.cut.joints,
                contacts=latest.cut.contacts,
                estimate=latest.estimate,
                T_wo_visual=None if seen is None else seen.T_wo,
                T_wo_true=self._truth_at(latest.cut.stamp_ns),
                frame=frame,
            )
        now_ns = clock.now_ns()
        joints, contacts = inputs.joints_at(now_ns), inputs.contacts_at(now_ns)
        if joints is None:
            return None
        none = np.zeros(self._pads, bool)
        return Snapshot(
            now_ns / 1e9, joints, none if contacts is None else contacts, None, None, None, frame
        )

    def _hand_over(self, snapshot: Snapshot) -> bool:
        """Whether the drawing process took it; waits while that is busy."""
        try:
            self._given.send(snapshot)
        except OSError:
            if not self._stop.is_set():
                log.warning("the viewer has gone; the run goes on without it")
            return False
        self.shown += 1
        return True


def _draw(taken: Connection, where: Where, setup: Setup) -> None:
    """The process that draws, until nobody gives it anything any more."""
    from vtgtsam.viz import names
    from vtgtsam.viz.frame import FrameDrawing
    from vtgtsam.viz.layout import Eye, layout
    from vtgtsam.viz.scene import Scene
    from vtgtsam.viz.stream import open_stream

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the run, which then ends this
    os.nice(_NICE)
    pads = setup.hand.pad_transforms(np.zeros(len(setup.hand.joint_names)), setup.T_wh)
    middle = pads[:, :3, 3].mean(axis=0)
    eye = Eye.beside(middle, camera=np.zeros(3), up=np.array([0.0, -1.0, 0.0]))
    arranged = layout(hidden=[names.TRACKER], eye=eye, images=["depth"])
    stream = open_stream("live run", arranged, save=where.save, spawn=where.spawn)
    scene = Scene(stream, setup.hand, setup.obj, camera_is_world=True)
    scene.at(0.0)
    scene.camera(setup.intrinsics, gtsam.Pose3())
    drawing = FrameDrawing(scene, setup.hand, setup.obj)
    while True:
        try:
            snapshot: Snapshot = taken.recv()
        except EOFError:
            break
        scene.at(snapshot.time)
        _draw_snapshot(scene, drawing, setup.T_wh, snapshot)
    stream.flush(timeout_sec=_END)


def _draw_snapshot(
    scene: Scene, drawing: FrameDrawing, T_wh: gtsam.Pose3, snapshot: Snapshot
) -> None:
    from vtgtsam.viz import names

    estimate, frame = snapshot.estimate, snapshot.frame
    if estimate is None:
        drawing.hand(snapshot.joints, T_wh, snapshot.contacts)
    else:
        distances, weights = estimate.pad_distances, estimate.pad_weights
        drawing.hand(snapshot.joints, T_wh, snapshot.contacts, distances, weights)
        drawing.verdict(names.LIVE, estimate.status, estimate.visual_weight)
        if estimate.T_wo is not None:
            drawing.pose(names.LIVE, estimate.T_wo, snapshot.T_wo_visual, snapshot.T_wo_true)
    if snapshot.T_wo_visual is not None:
        drawing.pose(names.TRACKER, snapshot.T_wo_visual, T_wo_true=snapshot.T_wo_true)
    if snapshot.T_wo_true is not None:
        scene.object(names.TRUTH, snapshot.T_wo_true)
    if frame is not None:
        scene.depth(frame.depth)
        if frame.color is not None:
            scene.color(frame.color)
