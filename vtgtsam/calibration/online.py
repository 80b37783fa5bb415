# SPDX-License-Identifier: MIT
"""A robot that calibrates itself while it works, from its first grasp on.

The grasp so far is solved anew every second or so, all of it at once, from what was known before it: an estimator that
carried the offsets along from frame to frame would be sure too soon. Its answer corrects the frames that come after. A
grasp that contradicts what is known of the robot changes nothing, and takes back what it had changed.
"""

from __future__ import annotations

import dataclasses
import logging
from collections import deque
from collections.abc import Callable, Sequence
from types import TracebackType

import gtsam
import numpy as np

from ..config import EstimatorConfig
from ..estimate import Estimate
from ..estimator import PoseEstimator
from ..hands.model import HandModel
from ..hands.pads import PadSet
from ..history import KEPT, SAME
from ..measurement import Measurement
from ..objects import ObjectModel
from .background import Background
from .calibration import Calibration
from .keyframes import GraspLog
from .one_grasp import Answer, Question, answer_to
from .posterior import Known, calibration_of
from .robot import Robot

PERIOD = 1.0  # [s], between two solutions
MOST_KEYFRAMES = (
    100  # of a grasp, so that solving takes as long after an hour as after a quarter of a minute
)
OVER = 2.0  # [s] without a touch, and a grasp is over

logger = logging.getLogger(__name__)

OnChange = Callable[[float, Calibration], None]


class OnlineCalibration:
    """A ``PoseEstimator`` that calibrates its robot.

    Used as one: ``update`` for each frame, ``reset``. Use it in a ``with`` statement, or ``close`` it.

    Args:
        hand: The hand, with joints.
        obj: The object; its mesh must be right.
        config: Settings, of a method with memory; the recommended ones where not given.
        prior: What is known of the robot already.
        robot: Hand and camera that the calibration is to name; the hand alone where not given.
        period: Time between two solutions [s].
        background: Whether to solve in a process of its own, so that no frame waits. Otherwise it happens within
            ``update``, and the same frames give the same poses.
        on_change: Told the instant [s] of the frame from which on a calibration is in force, and the calibration.

    Attributes:
        estimator: The estimator.
        config: Its settings.

    Raises:
        ValueError: The method has no memory.
        CalibrationError: The hand has no joints, or the prior is another's.
    """

    def __init__(
        self,
        hand: PadSet,
        obj: ObjectModel,
        config: EstimatorConfig | None = None,
        prior: Calibration | None = None,
        robot: Robot | None = None,
        *,
        period: float = PERIOD,
        background: bool = True,
        on_change: OnChange | None = None,
    ) -> None:
        config = EstimatorConfig() if config is None else config
        if not config.memory:
            raise ValueError(f"calibrating needs a method with memory, got {config.method!r}")
        if robot is None:
            robot = Robot.of_hand(hand) if prior is None else prior.robot
        robot.check_hand(hand)
        assert isinstance(hand, HandModel)  # what has joints is one
        self.config = config
        self._hand, self._obj, self._prior = hand, obj, prior
        self._robot, self._period, self._on_change = robot, period, on_change
        self.estimator = PoseEstimator(hand, obj, config, prior)
        self._background = Background(hand, obj) if background else None
        self._known: Known | None = None  # with the first frame
        self._answer: Answer | None = None  # to the last question, not yet in force
        self._asked: float | None = None  # when
        self._learnt: Answer | None = None  # what is in force from this grasp
        self._grasps = 0
        self._shown = False
        self._begin_grasp()

    @property
    def calibration(self) -> Calibration | None:
        """The calibration in force; None: none yet."""
        return self.estimator.calibration

    @property
    def learnt(self) -> bool:
        """Whether a grasp has shown anything of the robot that still holds."""
        return self._shown or self._learnt is not None

    def update(self, measurement: Measurement) -> Estimate:
        """Fuse one frame, as ``PoseEstimator.update``."""
        if self._background is not None:
            self._answer = self._background.answer() or self._answer
        if self._answer is not None:
            self._take(self._answer, measurement.time)
            self._answer = None
        estimate = self.estimator.update(measurement)
        if self._known is None:
            self._known = Known.before(
                self._robot, self._hand, measurement, self._prior, self.config
            )
        self._note(measurement, estimate)
        self._ask(measurement.time)
        return estimate

    def reset(self, T_wo: gtsam.Pose3 | None = None) -> None:
        """Forget the object, as ``PoseEstimator.reset``; what is known of the robot stays."""
        self.estimator.reset(T_wo)
        self._asked = None
        self._end_grasp()

    def finish(self) -> None:
        """Solve the grasp so far a last time, here, when no frame is to come: a second or a few.

        ``calibration`` then has all of it; ``on_change`` is not told, since nothing is corrected with it any more.
        """
        if self._known is not None and self._log.keyframes:
            self._on_change = None
            self._take(answer_to(self._question(self._known)), self._log.keyframes[-1].time)

    def close(self) -> None:
        """End the process that solves."""
        if self._background is not None:
            self._background.close()

    def __enter__(self) -> OnlineCalibration:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _note(self, measurement: Measurement, estimate: Estimate) -> None:
        """Add a frame to the grasp."""
        last = self._log.keyframes[-1].time if self._log.keyframes else measurement.time
        if measurement.time > last + OVER:
            self._end_grasp()
        self._log.add(*self._at_image(measurement, estimate))

    def _at_image(
        self, measurement: Measurement, estimate: Estimate
    ) -> tuple[Measurement, Estimate]:
        """A frame whose visual pose is late, with hand and object where they were at its instant."""
        T_wh = gtsam.Pose3() if measurement.T_wh is None else measurement.T_wh
        self._hands.append((measurement.time, T_wh))
        while self._hands[0][0] < measurement.time - KEPT:
            self._hands.popleft()
        seen_at = measurement.visual_time
        if seen_at is None or seen_at >= measurement.time - SAME:
            return measurement, estimate
        then = _between(self._hands, seen_at)
        T_wo = None if estimate.T_wo is None else then.compose(T_wh.between(estimate.T_wo))
        at_image = dataclasses.replace(measurement, T_wh=then, visual_time=None)
        return at_image, dataclasses.replace(estimate, T_wo=T_wo)

    def _ask(self, time: float) -> None:
        """Have the grasp solved anew, if it is time to."""
        assert self._known is not None
        if self._asked is None:
            self._asked = time
        busy = self._background is not None and self._background.busy
        if busy or time < self._asked + self._period or not self._log.keyframes:
            return
        self._asked = time
        question = self._question(self._known)
        if self._background is not None:
            self._background.ask(question)
        else:
            self._answer = answer_to(question)

    def _question(self, known: Known) -> Question:
        """What the grasp so far says, as a question."""
        start = known.belief if self._learnt is None else self._learnt.belief
        return Question(
            number=self._grasps,
            grasp=self._log.grasp("this grasp"),
            known=known.belief,
            start=start.mean,
            camera_origin=known.camera_origin,
            config=self.config,
        )

    def _take(self, answer: Answer, time: float) -> None:
        """Go on with what a grasp says, from the frame of an instant [s] on."""
        assert self._known is not None
        if answer.number != self._grasps:
            return  # of a grasp that is over
        if answer.refused:
            logger.info("not calibrated from this grasp: %s", answer.refused)
            if self._learnt is None:
                return
        self._learnt = None if answer.refused else answer
        self._log.place(answer.poses)
        belief = self._known.belief if answer.refused else answer.belief
        calibration = calibration_of(belief, self._known, [self._log.grasp("this grasp")])
        self.estimator.recalibrate(calibration)
        if self._on_change is not None:
            self._on_change(time, calibration)

    def _begin_grasp(self) -> None:
        self._grasps += 1
        self._log = GraspLog(self._hand, self._obj, MOST_KEYFRAMES)
        self._hands: deque[tuple[float, gtsam.Pose3]] = deque()

    def _end_grasp(self) -> None:
        """What this grasp has shown is known from now on."""
        if self._learnt is not None and self._known is not None:
            self._known = self._known._replace(belief=self._learnt.belief)
            self._shown = True
        self._learnt = None
        self._begin_grasp()


def _between(poses: Sequence[tuple[float, gtsam.Pose3]], time: float) -> gtsam.Pose3:
    """The pose at an instant [s], between those before and after; the first one before all."""
    times = [at for at, _ in poses]
    after = int(np.searchsorted(times, time))
    if after == 0:
        return poses[0][1]
    (start, T), (end, T_end) = poses[after - 1], poses[min(after, len(poses) - 1)]
    share = (time - start) / (end - start) if end > start else 0.0
    pose: gtsam.Pose3 = T.slerp(share, T_end)
    return pose
