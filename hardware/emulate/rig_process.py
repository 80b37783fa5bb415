# SPDX-License-Identifier: MIT
"""A rig in a process of its own, and its camera as a camera of ours."""

from __future__ import annotations

import contextlib
import multiprocessing
import queue
import signal
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING, Any

import gtsam
import numpy as np

from hardware.camera.camera import Camera, CameraError, CameraFrame
from hardware.servo.description import HandDescription
from hardware.tactile.pressure import PadScale
from vtgtsam import ObjectModel
from vtgtsam.camera import CameraIntrinsics
from vtgtsam.exceptions import VtgtsamError

if TYPE_CHECKING:
    from .rig import Rig, Shot

_START = (
    600.0  # [s], the search for a pose to grasp from may take a minute or two on a slow computer
)
_WAIT = 5.0  # [s], for an answer or an image
_JOIN = 5.0  # [s]
_WATCHDOG = 4.0  # [s], longer than any Bus Watchdog (2.54 s)
_SWITCH = 0.0005  # [s], after which a computing thread lets others in
_REST = 0.2, 0.0005  # [s, m], the object is at rest when it moves no farther in that time
_SETTLING = 5.0  # [s], after which a restless object is taken as it is


@dataclass(frozen=True, eq=False)
class Ready:
    """What a rig says when it is up; as in ``Rig``."""

    servos: str
    pads: str
    intrinsics: CameraIntrinsics
    T_ch: np.ndarray
    scale: PadScale


class RigProcess:
    """An emulated hand, object and camera that run beside this program; a context manager.

    The process ends when this one does, however it ends.

    Attributes:
        ready: Its ports and calibrations.
    """

    def __init__(self, description: HandDescription, obj: ObjectModel, seed: int = 0) -> None:
        """Start it.

        Raises:
            VtgtsamError: It cannot start, such as for an object that cannot be grasped.
        """
        context = multiprocessing.get_context("spawn")
        self._control, control = context.Pipe()
        self._images, images = context.Pipe()
        arguments = (description, obj, seed, control, images)
        self._process = context.Process(target=_serve, args=arguments, name="rig", daemon=True)
        self._process.start()
        control.close()
        images.close()
        try:
            self.ready: Ready = self._answer(_START)
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> RigProcess:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """End it."""
        self._control.close()
        self._images.close()
        self._process.join(_JOIN)
        if self._process.is_alive():
            self._process.kill()

    def put_object(self) -> None:
        """Put the object on the palm; returns when it has come to rest."""
        self._control.send("put")
        self._answer(_WAIT + 10)

    def lost(self) -> float:
        """Time that was not simulated because the computer was too slow [s]."""
        self._control.send("lost")
        return float(self._answer(_WAIT))

    def camera(self, show_truth: Callable[[float, gtsam.Pose3], None]) -> Camera:
        """Its camera.

        Args:
            show_truth: Called with the monotonic time [s] of each image and the true pose T_co.
        """
        return _RigCamera(self._images, self.ready.intrinsics, show_truth)

    def _answer(self, seconds: float) -> Any:
        try:
            if self._control.poll(seconds):
                answer = self._control.recv()
                if isinstance(answer, VtgtsamError):
                    raise answer
                return answer
        except (EOFError, OSError) as error:
            raise VtgtsamError("the emulated hand's process has died") from error
        raise VtgtsamError(f"the emulated hand did not answer within {seconds:.0f} s")


class _RigCamera(Camera):
    """The rig's camera, seen from the live loop."""

    def __init__(
        self,
        images: Connection,
        intrinsics: CameraIntrinsics,
        show_truth: Callable[[float, gtsam.Pose3], None],
    ) -> None:
        self.name = "emulated camera"
        self.intrinsics = intrinsics
        self._images = images
        self._show_truth = show_truth

    def read(self) -> CameraFrame:
        """The newest image; those that nobody has taken in time are gone, as with a real camera."""
        try:
            self._images.send("next")
            if not self._images.poll(_WAIT):
                raise CameraError(f"no image from the {self.name} for {_WAIT:.0f} s")
            shot = self._images.recv()
        except (EOFError, OSError) as error:
            raise CameraError(f"the {self.name} has gone") from error
        self._show_truth(shot.time, gtsam.Pose3(shot.T_co))
        return CameraFrame(shot.time, shot.depth, None)

    def close(self) -> None:
        """Nothing is held."""


def _serve(
    description: HandDescription,
    obj: ObjectModel,
    seed: int,
    control: Connection,
    images: Connection,
) -> None:
    """The rig's process."""
    # Ctrl-C reaches all processes of a terminal; the servos must outlive the program that drives them.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.setswitchinterval(_SWITCH)
    from .rig import Rig

    try:
        with Rig(description, obj, seed) as rig:
            T_wo = rig.prepare()
            ports = (rig.servos.path, rig.pads.path)
            control.send(Ready(*ports, rig.intrinsics, rig.T_ch.matrix(), rig.scale))
            # What ends the program reaches its whole group as well; it ends us by hanging up.
            for number in (signal.SIGTERM, signal.SIGHUP):
                signal.signal(number, signal.SIG_IGN)
            _Server(rig, T_wo, control, images).run()
    except VtgtsamError as error:
        control.send(error)
    except BrokenPipeError:  # the program did not wait
        return


class _Server:
    """Carries out what the program asks, until it is gone."""

    def __init__(self, rig: Rig, T_wo: np.ndarray, control: Connection, images: Connection) -> None:
        self._rig = rig
        self._T_wo = T_wo
        self._control = control
        self._images = images
        self._stop = threading.Event()
        self._newest: queue.Queue[Shot] = queue.Queue(1)

    def run(self) -> None:
        film = (self._newest_only, self._stop)
        threading.Thread(target=self._rig.film, args=film, name="camera", daemon=True).start()
        threading.Thread(target=self._hand_out, name="images", daemon=True).start()
        try:
            while True:
                self._control.send(self._carry_out(self._control.recv()))
        except (EOFError, OSError):
            self._tell_torque()
        self._stop.set()

    def _carry_out(self, order: str) -> float:
        if order == "put":
            self._rig.hand.put(self._T_wo)
            return self._settle()
        if order == "lost":
            return self._rig.hand.lost
        raise ValueError(f"unknown order {order!r}")

    def _settle(self) -> float:
        """Wait until the object lies still; the time it took [s]."""
        start, before = time.monotonic(), np.full((4, 4), np.inf)
        while (took := time.monotonic() - start) < _SETTLING:
            _, _, T_wo = self._rig.hand.look()
            if took > 5 * _REST[0] and np.abs(T_wo - before)[:3, 3].max() < _REST[1]:
                break
            before = T_wo
            time.sleep(_REST[0])
        return took

    def _newest_only(self, shot: Shot) -> None:
        """Keep an image until it is asked for or the next one is there."""
        with contextlib.suppress(queue.Empty):
            self._newest.get_nowait()
        self._newest.put(shot)

    def _hand_out(self) -> None:
        """Give an image whenever one is asked for."""
        with contextlib.suppress(EOFError, OSError):  # nobody looks any more
            while self._images.recv():
                self._images.send(self._newest.get())

    def _tell_torque(self) -> None:
        """The program has ended: does the hand still have torque?"""
        deadline = time.monotonic() + _WATCHDOG
        obeying, stopped = self._rig.driven()
        while obeying and time.monotonic() < deadline:
            time.sleep(0.02)
            obeying, stopped = self._rig.driven()
        if obeying:
            self._say(f"the program has gone, {obeying} servos still have torque!")
        elif stopped:
            self._say(f"the program has gone, {stopped} servos were stopped by their watchdogs")

    def _say(self, text: str) -> None:
        print(f"emulated hand: {text}", file=sys.stderr, flush=True)
