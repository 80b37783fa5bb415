# SPDX-License-Identifier: MIT
"""Where a tracked object is expected in the next image, and how surely.

A tracker that knows the hand lets it carry the object, T_wo = T_wh T_ho with T_ho constant but for a random walk:
small in a hand at rest, larger while joints move and fingers may push it. One that does not knows only that objects
move little from image to image.

    prediction  P <- P + Q           update  P^-1 <- P^-1 + L / n

with L the image's information. What an image gets wrong, the next one gets wrong too, so that n images count as one.

Beside that it keeps what images alone have told, the first pose left out and each one counted in full: A, how
uncertain the followed pose is by those errors that are new in each image. With the gain k = 1 - A(t) A(t-)^-1 of an
image, (1 - k)^n of such an error is left after n images, so that it stays alike for (2 - k) / k of them in all.
"""

from __future__ import annotations

import gtsam
import numpy as np

from .alignment import STEP_SIGMA, Shape

AT_REST = 0.005  # [rad], a joint that moves less between two images is at rest (0.15 rad/s)
# Images that err together if all of the camera's noise stays: where nothing moves, and where fingers do.
TOGETHER, TOGETHER_MOVING = 200.0, 3.0
HELD = np.repeat([0.004, 0.0002], 3)  # [rad, m], what an object moves in a hand at rest, an image
PUSHED = np.repeat([0.55, 0.03], 3)  # [rad/rad, m/rad], more for each radian that a joint moves
WEAK = 0.01  # share of the prior STEP_SIGMA that is left where no image has told anything: 0.5 rad, 0.1 m
START = np.repeat([0.05, 0.005], 3)  # [rad, m], what a first pose may be off


class Expectation:
    """Where an object is expected.

    Attributes:
        T_wo: Its pose.
    """

    def __init__(self, shape: Shape, T_wo: gtsam.Pose3) -> None:
        self.T_wo = T_wo
        self._to_center = shape.to_center()
        self._covariance = np.diag(START**2)  # of a perturbation at the object's centre
        self._averaged = np.diag(STEP_SIGMA**2 / WEAK)  # the same, by the images alone
        self._gain = 1.0
        self._T_wh: gtsam.Pose3 | None = None
        self._joints: np.ndarray | None = None
        self._together = 1.0

    def carry(self, T_wh: gtsam.Pose3, joints: np.ndarray, persistence: float) -> None:
        """Let the hand carry it to where the hand is at the next image.

        Args:
            T_wh: Where that is.
            joints: The hand's joint angles there [rad].
            persistence: Share of the camera's noise that stays from image to image, in [0, 1].
        """
        if self._T_wh is not None and self._joints is not None:
            self.T_wo = T_wh * self._T_wh.inverse() * self.T_wo
            turned = float(np.abs(joints - self._joints).max(initial=0.0))
            self._move(HELD**2 + (PUSHED * turned) ** 2)
            most = TOGETHER if turned < AT_REST else TOGETHER_MOVING
            self._together = 1.0 + persistence * (most - 1.0)
        self._T_wh, self._joints = T_wh, joints

    @property
    def is_carried(self) -> bool:
        """Whether a hand is known to carry it."""
        return self._T_wh is not None

    def wait(self) -> None:
        """Expect it where it was, though it may have moved."""
        self._move(STEP_SIGMA**2)

    def _move(self, variances: np.ndarray) -> None:
        self._covariance += np.diag(variances)
        self._averaged += np.diag(variances)

    def information(self) -> np.ndarray:
        """Of a perturbation [rotation, translation] of the object frame, as much as an image's counts, (6, 6)."""
        at_center = self._together * np.linalg.inv(self._covariance)
        information: np.ndarray = self._to_center.T @ at_center @ self._to_center
        return information

    @property
    def averaged(self) -> np.ndarray:
        """A, the covariance (6, 6) of a perturbation [rotation, translation] of the object frame; see above."""
        from_center = np.linalg.inv(self._to_center)
        covariance: np.ndarray = from_center @ self._averaged @ from_center.T
        return covariance

    @property
    def images_alike(self) -> float:
        """For how many images an error that is new in one stays in the followed pose; 1 if in that one alone."""
        return (2.0 - self._gain) / self._gain

    def update(
        self,
        T_wo: gtsam.Pose3,
        information: np.ndarray,
        credible: np.ndarray,
        anew: bool = False,
    ) -> None:
        """Take in the pose found in an image, with the image's own information (6, 6).

        Args:
            T_wo: The pose.
            information: Of a perturbation of the object frame, by which it was found.
            credible: What of that the image is believed to have told.
            anew: Whether it owes nothing to the images before, being found and not followed.
        """
        if anew:
            self._covariance = self._averaged = np.diag(STEP_SIGMA**2 / WEAK)
        from_center = np.linalg.inv(self._to_center)
        shown = from_center.T @ information @ from_center
        self._covariance = np.linalg.inv(np.linalg.inv(self._covariance) + shown / self._together)
        before = np.linalg.inv(self._averaged)
        self._averaged = np.linalg.inv(before + from_center.T @ credible @ from_center)
        gain = np.eye(6) - self._averaged @ before
        # Its mean, of directions that images show; along the others it is next to nothing.
        self._gain = float(np.trace(gain @ gain) / max(np.trace(gain), 1e-12))
        self.T_wo = T_wo
