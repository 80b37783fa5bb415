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
from contextlib import ExitStack
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import gtsam
import numpy as np

from ..camera import CameraIntrinsics
from ..estimate import Estimate
from ..hands.model import HandModel
from ..objects import ObjectModel
from .clock import Clock
from .fusion import Fused, Fusion
from .inputs import Inputs
from .page import Address, PageServer, check_page
from .threads import Ticker
from .verdict import in_words

if TYPE_CHECKING:
    from ..viz.layout import Eye

log = logging.getLogger(__name__)

RATE = 10.0  # [Hz]
_END = 10.0  # [s], for the last values to be written; by then the torque is off
_TRUTHS = 64  # kept, two seconds
_RECENT_NS = 100_000_000  # between an image and a frame, for the true pose of the one to be that of the other
_NICE = 5  # the hand goes first


class Images(Protocol):
    """A camera's images of one instant."""

    @property
    def depth(self) -> np.ndarray:
        """Depth [m], shape (H, W), 0 where nothing was measured."""
        ...

    @property
    def color(self) -> np.ndarray | None:
        """RGB, uint8, shape (H, W, 3), or None."""
        ...


@dataclass(frozen=True)
class Where:
    """Where to show a run.

    Attributes:
        page: Address of the live page, or None.
        save: Rerun's file to write, .rrd, or None.
    """

    page: Address | None = None
    save: Path | None = None

    def check(self) -> None:
        """Find out before anything moves.

        Raises:
            VtgtsamError: Rerun is missing, or the file cannot be written.
        """
        if self.page is not None:
            check_page()
        if self.save is not None:
            from ..viz.stream import check_writable

            check_writable(self.save)


@dataclass(frozen=True, eq=False)
class Setup:
    """What does not change in a run.

    Attributes:
        hand: The hand.
        obj: The object.
        T_wh: Pose of the hand in the world, as far as it is known.
        intrinsics: The camera's, where there are images.
        camera_is_world: Whether the world frame is the camera's, y down and z forward; else z is up.
        truth: Whether true poses are known.
    """

    hand: HandModel
    obj: ObjectModel
    T_wh: gtsam.Pose3
    intrinsics: CameraIntrinsics | None = None
    camera_is_world: bool = False
    truth: bool = False


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The newest values at one instant.

    Attributes:
        time: The estimate's instant, or the present where there is no new one [s].
        joints: Joint angles [rad].
        T_wh: The hand's pose; None: as before.
        contacts: Contact bits, shape (K,).
        estimate: The newest estimate; None where there is none since the last snapshot.
        T_wo_visual: What the tracker said of the image that the frame took.
        T_wo_true: The true pose in the last image, where an emulator knows it.
        images: The newest images.
        words: How the streams are, Markdown.
    """

    time: float
    joints: np.ndarray
    T_wh: gtsam.Pose3 | None
    contacts: np.ndarray
    estimate: Estimate | None
    T_wo_visual: gtsam.Pose3 | None
    T_wo_true: gtsam.Pose3 | None
    images: Images | None
    words: str


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
        self._server = ExitStack()
        if where.page is not None:
            self._server.enter_context(PageServer(where.page))
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
        clock: Clock,
        images: Callable[[], Images | None] = lambda: None,
        words: Callable[[], str] = lambda: "",
    ) -> None:
        """Begin to show.

        Args:
            inputs: The streams.
            fusion: The estimator's thread.
            clock: The present, by the clock of the stamps.
            images: Gives the camera's newest images.
            words: Says how the streams are, in Markdown.
        """

        def run() -> None:
            ticker = Ticker(RATE)
            while ticker.wait(self._stop):
                snapshot = self._snapshot(inputs, fusion, clock, images(), words())
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
        self._server.close()

    def _snapshot(
        self, inputs: Inputs, fusion: Fusion, clock: Clock, images: Images | None, words: str
    ) -> Snapshot | None:
        """The last frame where it is a new one, else joints and contacts as they are."""
        latest = None if fusion.latest is self._last else fusion.latest
        self._last = fusion.latest
        if latest is not None:
            seen = latest.cut.visual
            return Snapshot(
                time=latest.estimate.time,
                joints=latest.cut.joints,
                T_wh=latest.cut.T_wh,
                contacts=latest.cut.contacts,
                estimate=latest.estimate,
                T_wo_visual=None if seen is None else seen.T_wo,
                T_wo_true=self._truth_at(latest.cut.stamp_ns),
                images=images,
                words=words,
            )
        now_ns = clock()
        joints, contacts = inputs.joints_at(now_ns), inputs.contacts_at(now_ns)
        if joints is None:
            return None
        bits = np.zeros(self._pads, bool) if contacts is None else contacts
        return Snapshot(now_ns / 1e9, joints, None, bits, None, None, None, images, words)

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
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the run, which then ends this
    os.nice(_NICE)
    picture = _Picture(where, setup)
    while True:
        try:
            snapshot: Snapshot = taken.recv()
        except EOFError:
            break
        picture.draw(snapshot)
    picture.end()


class _Picture:
    """The scene of a run."""

    def __init__(self, where: Where, setup: Setup) -> None:
        from ..viz import names
        from ..viz.frame import FrameDrawing
        from ..viz.layout import layout
        from ..viz.scene import Scene
        from ..viz.stream import open_stream

        arranged = layout(
            hidden=[names.TRACKER],
            eye=_eye(setup),
            images=[] if setup.intrinsics is None else ["depth"],
            live=True,
            truth=setup.truth,
        )
        sink = None if where.page is None else where.page.sink
        self._stream = open_stream("live run", arranged, save=where.save, connect=sink)
        self._scene = Scene(self._stream, setup.hand, setup.obj, setup.camera_is_world)
        self._drawing = FrameDrawing(self._scene, setup.hand, setup.obj)
        self._T_wh = setup.T_wh
        if setup.intrinsics is not None:
            self._scene.at(0.0)
            self._scene.camera(setup.intrinsics, gtsam.Pose3())

    def draw(self, snapshot: Snapshot) -> None:
        """Draw the newest values."""
        from ..viz import names

        scene, drawing = self._scene, self._drawing
        scene.at(snapshot.time)
        self._T_wh = snapshot.T_wh or self._T_wh
        estimate = snapshot.estimate
        if estimate is None:
            drawing.hand(snapshot.joints, self._T_wh, snapshot.contacts)
        else:
            distances, weights = estimate.pad_distances, estimate.pad_weights
            drawing.hand(snapshot.joints, self._T_wh, snapshot.contacts, distances, weights)
            scene.status(names.LIVE, in_words(estimate))
            if snapshot.T_wo_visual is not None:
                scene.plot(names.WEIGHT, names.LIVE, estimate.visual_weight)
            scene.contact_points(estimate.contact_points_w, snapshot.contacts, weights)
            if estimate.T_wo is not None:
                T_wo, true = estimate.T_wo, snapshot.T_wo_true
                drawing.pose(names.LIVE, T_wo, snapshot.T_wo_visual, true)
                scene.uncertainty(names.LIVE, T_wo, estimate.covariance)
        if snapshot.T_wo_visual is not None:
            drawing.pose(names.TRACKER, snapshot.T_wo_visual, T_wo_true=snapshot.T_wo_true)
        if snapshot.T_wo_true is not None:
            scene.object(names.TRUTH, snapshot.T_wo_true)
        if snapshot.words:
            scene.words(snapshot.words)
        self._draw_images(snapshot.images)

    def _draw_images(self, images: Images | None) -> None:
        if images is not None:
            self._scene.depth(images.depth)
            if images.color is not None:
                self._scene.color(images.color)

    def end(self) -> None:
        """Let everything be written."""
        self._stream.flush(timeout_sec=_END)


def _eye(setup: Setup) -> Eye:
    """From beside the camera where that is the world, else from in front and above."""
    from ..viz.layout import Eye

    pads = setup.hand.pad_transforms(np.zeros(len(setup.hand.joint_names)), setup.T_wh)
    middle = pads[:, :3, 3].mean(axis=0)
    if setup.camera_is_world:
        return Eye.beside(middle, camera=np.zeros(3), up=np.array([0.0, -1.0, 0.0]))
    return Eye.beside(middle, middle + np.array([1.0, 0.0, 0.0]), up=np.array([0.0, 0.0, 1.0]))
