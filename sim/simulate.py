# SPDX-License-Identifier: MIT
"""One sequence: the object comes to rest, the hand closes, the wrist turns it backward."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from vtgtsam.grasp import GraspController

from . import constants as c
from .events import BEGIN, LONGER, Happening, happening, instant
from .world import World


class Rejected(Exception):
    """A sample that belongs in no dataset; the message is the reason."""


@dataclass(frozen=True)
class Trajectory:
    """What truly happened in one sequence.

    Time 0 is where the grasp begins. T samples at 100 Hz, F frames at the camera's instants (33 ms).

    Attributes:
        time: Instants of the samples [s], shape (T,).
        joints: Joint angles in the hand's order [rad], shape (T, J).
        T_wh: Pose of the hand, shape (T, 4, 4).
        T_wo: Pose of the object, shape (T, 4, 4).
        pressure: Normal force of the object on each pad as a fraction of 6 N, shape (T, K).
        contacts: Whether the object touches each pad, shape (T, K).
        overlap: By how much it overlaps the pad [m], shape (T, K), NaN where it does not touch.
        frame_time: Instants of the frames [s], shape (F,).
        frame_joints: As ``joints``, shape (F, J).
        frame_T_wh: As ``T_wh``, shape (F, 4, 4).
        frame_T_wo: As ``T_wo``, shape (F, 4, 4).
    """

    time: np.ndarray
    joints: np.ndarray
    T_wh: np.ndarray
    T_wo: np.ndarray
    pressure: np.ndarray
    contacts: np.ndarray
    overlap: np.ndarray
    frame_time: np.ndarray
    frame_joints: np.ndarray
    frame_T_wh: np.ndarray
    frame_T_wo: np.ndarray


def simulate(world: World, T_wo: np.ndarray, event: str | None = None) -> Trajectory:
    """Simulate one sequence from a start pose of the object, shape (4, 4).

    Args:
        world: Hand and object.
        T_wo: Where the object starts, shape (4, 4).
        event: What happens to the grasp once it holds, one of ``events.EVENTS``.

    Raises:
        Rejected: The object starts inside the hand, does not rest on it, or is not grasped; or the event does not
            happen.
    """
    world.place(T_wo)
    if world.overlap_with_hand() > 0.0:
        raise Rejected("overlaps the hand at the start")
    course = _Course(world, None if event is None else happening(event, world))
    course.run(-c.REST, 0.0)
    _check_rest(world)
    course.run(0.0, c.TURN_START)
    _check_grasp(world)
    T_ho = np.linalg.solve(world.T_wh(), world.T_wo())
    held_until = c.DURATION if event is None else BEGIN
    course.run(c.TURN_START, held_until)
    if event is None:
        course.record(steps_since(c.DURATION))
    _check_hold(world, T_ho)
    if event is None:
        return course.trajectory()
    course.run(held_until, c.DURATION + LONGER)
    course.record(steps_since(c.DURATION + LONGER))
    trajectory = course.trajectory()
    if event_instant(world, trajectory, event) is None:
        raise Rejected(f"no {event} where there should be one")
    return trajectory


def event_instant(world: World, trajectory: Trajectory, event: str) -> float | None:
    """When an event truly happened [s], or None."""
    t = trajectory
    return instant(event, t.time, t.T_wh, t.T_wo, t.contacts, world.obj.center)


def steps_since(time: float) -> int:
    """Number of time steps from time 0 to an instant [s]."""
    return round(time / c.TIME_STEP)


def wrist_angle(time: float) -> float:
    """Commanded backward angle of the wrist [rad]."""
    progress = (time - c.TURN_START) / (c.TURN_END - c.TURN_START)
    return float(c.TURN_ANGLE * np.clip(progress, 0.0, 1.0))


class _Course:
    """Steps a world through a sequence and writes down what happens."""

    def __init__(self, world: World, event: Happening | None = None) -> None:
        self._world = world
        self._event = event
        self._controller = GraspController(world.description, world.hand.joint_names, world.limits)
        self._samples: list[tuple[np.ndarray, ...]] = []
        self._frames: list[tuple[np.ndarray, ...]] = []

    def run(self, start: float, end: float) -> None:
        """From one instant up to, and without, another [s]."""
        for step in range(steps_since(start), steps_since(end)):
            self.record(step)
            if self._event is not None:
                self._event.act(step * c.TIME_STEP)
            self._world.step()
        self._world.refresh()

    def record(self, step: int) -> None:
        """Control the hand and write down the state where it is time to."""
        world, time = self._world, step * c.TIME_STEP
        sample, frame = step % c.STEPS_PER_SAMPLE == 0, step % c.STEPS_PER_FRAME == 0
        if step >= 0 and (sample or frame):
            world.refresh()
            state = (np.array(time), world.joints(), world.T_wh(), world.T_wo())
            if sample:
                force, overlap = world.touch()
                touching = ~np.isnan(overlap)
                self._samples.append((*state, force / c.FULL_PRESSURE, touching, overlap))
            if frame:
                self._frames.append(state)
        if sample:
            period = c.STEPS_PER_SAMPLE * c.TIME_STEP
            command = self._controller.step(time, period, world.joints())
            wrist = wrist_angle(time)
            if self._event is not None:
                command, wrist = self._event.command(time, command, wrist)
            world.command(command, wrist)

    def trajectory(self) -> Trajectory:
        columns = [*zip(*self._samples, strict=True), *zip(*self._frames, strict=True)]
        names = [field.name for field in fields(Trajectory)]
        return Trajectory(**{n: np.array(column) for n, column in zip(names, columns, strict=True)})


def _check_rest(world: World) -> None:
    if world.overlap_with_hand() == 0.0:
        raise Rejected("does not rest on the hand")
    if world.object_speed() > c.MAX_REST_SPEED:
        raise Rejected("still moves when the grasp begins")


def _check_grasp(world: World) -> None:
    if not _grasped(world):
        raise Rejected("is not grasped when the hand has closed")
    if world.object_speed() > c.MAX_HELD_SPEED:
        raise Rejected("still moves when the hand has closed")


def _check_hold(world: World, T_ho: np.ndarray) -> None:
    now = np.linalg.solve(world.T_wh(), world.T_wo())
    center = np.append(world.obj.center, 1.0)
    if np.linalg.norm((now - T_ho) @ center) > c.MAX_SLIP:
        raise Rejected("slips while the hand turns")
    if not _grasped(world):
        raise Rejected("is no longer grasped after the turn")


def _grasped(world: World) -> bool:
    touched = world.touch()[0] > 0.0
    return bool(
        np.sum(touched) >= c.MIN_PADS and np.sum(touched[world.on_fingers]) >= c.MIN_FINGER_PADS
    )
