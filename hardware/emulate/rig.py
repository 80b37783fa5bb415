# SPDX-License-Identifier: MIT
"""One simulated grasp behind all the emulated devices: servos, pad board and depth camera.

The servos move MuJoCo's joints, what they press comes back as resistance of the pads, and the camera
casts rays at the same scene. A rig is meant to live in a process of its own (``rig_process``): Python's
threads share one interpreter lock, and a rig among the live loop's threads would slow both.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import gtsam
import numpy as np

from hardware.servo.description import HandDescription, wiring_of
from sim.camera import D435, DepthCamera, add_depth_noise
from sim.observe import camera_pose, window
from sim.placement import CLEARANCE
from sim.power_grasp import power_grasp
from sim.replay import Replay
from sim.world import World
from vtgtsam import ObjectModel
from vtgtsam.exceptions import VtgtsamError
from vtgtsam.grasp import load_grasp
from vtgtsam.live.threads import Ticker

from .motor import JointPlant
from .pad_signal import PadSignal, bench_scale, pad_parameters
from .pads import PadBoardEmulator
from .servos import ServoLineEmulator
from .simulated_hand import SimulatedHand

CAMERA_RATE = 30.0  # [Hz]
# Of the D435's resolution. A quarter of its pixels takes the ray caster 5 ms an image, all take 17 ms,
# which leaves two slow cores no time for the rest.
CAMERA_SCALE = 0.5


@dataclass(frozen=True, eq=False)
class Shot:
    """One image of the emulated camera and what was true at that instant.

    Attributes:
        time: Monotonic time [s].
        depth: [m], shape (H, W), float32.
        T_co: The object's true pose in the camera frame, shape (4, 4).
    """

    time: float
    depth: np.ndarray
    T_co: np.ndarray


class Rig:
    """The emulated devices; a context manager.

    Args:
        description: The built hand to emulate.
        obj: The object for its grasp.
        seed: Of the camera's noise and the pads.

    Attributes:
        servos: The emulated servo line.
        pads: The emulated pad board.
        intrinsics: Of the camera.
        T_ch: The hand's pose in the camera frame.
        scale: The pads' bench calibration.
    """

    def __init__(self, description: HandDescription, obj: ObjectModel, seed: int = 0) -> None:
        wiring = wiring_of(description)
        grasp = load_grasp(description.hand)
        self.world = World(grasp, grasp.load_hand(), obj)
        self.hand = SimulatedHand(self.world)
        pad_seed, self._camera_seed = np.random.SeedSequence(seed).spawn(2)
        parameters = pad_parameters(wiring, pad_seed)
        self.scale = bench_scale(wiring, parameters)
        self._pad_order = [self.world.hand.pad_names.index(name) for name in wiring.pad_names]
        self.T_wc = camera_pose(self.world)
        self.intrinsics = window(self.world, self.T_wc, D435.scaled(CAMERA_SCALE))
        self.T_ch = self.T_wc.between(gtsam.Pose3(self.hand.look()[1]))
        plant = JointPlant(description.joints, self.hand)
        ids = [joint.id for joint in description.joints]
        self.servos = ServoLineEmulator(ids, description.baud, plant)
        signal = PadSignal(parameters, np.random.default_rng(pad_seed))
        self.pads = PadBoardEmulator(wiring, signal, self._forces)

    def __enter__(self) -> Rig:
        return self

    def __exit__(self, *exception: object) -> None:
        self.pads.close()
        self.servos.close()

    def prepare(self) -> np.ndarray:
        """A pose T_wo, shape (4, 4), from which the hand can grasp the object; may take a while.

        Raises:
            VtgtsamError: There is none.
        """
        T_wo = power_grasp(World(self.world.description, self.world.hand, self.world.obj))
        if T_wo is None:
            raise VtgtsamError(
                f"the simulated {self.world.hand.name} cannot grasp {self.world.obj.name}: "
                "choose another object, such as can"
            )
        T_wo = T_wo.copy()
        T_wo[2, 3] += CLEARANCE
        return T_wo

    def film(self, show: Callable[[Shot], None], stop: threading.Event) -> None:
        """Take images at 30 Hz, or as fast as it goes, until ``stop`` is set."""
        camera = DepthCamera(self.world.model, self.intrinsics)
        replay = Replay(self.world.model, self.world.hand.joint_names)
        rng = np.random.default_rng(self._camera_seed)
        ticker = Ticker(CAMERA_RATE)
        while ticker.wait(stop):
            instant = time.monotonic()
            joints, T_wh, T_wo = self.hand.look()
            replay.show(joints, T_wh, T_wo)
            clean, _ = camera.render(replay.data, self.T_wc)
            image = add_depth_noise(clean, rng).astype(np.float32)
            show(Shot(instant, image, self.T_wc.inverse().matrix() @ T_wo))

    def driven(self) -> tuple[int, int]:
        """How many servos obey their goals with torque on, and how many their watchdog has stopped."""
        with self.servos.lock:
            on = [servo for servo in self.servos.servos.values() if servo.torque]
            stopped = sum(servo.tripped for servo in on)
            return len(on) - stopped, stopped

    def _forces(self, elapsed: float) -> tuple[np.ndarray, np.ndarray]:
        normal = self.hand.pad_forces()[self._pad_order]
        return normal, np.zeros_like(normal)
