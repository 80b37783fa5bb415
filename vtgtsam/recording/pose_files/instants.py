# SPDX-License-Identifier: MIT
"""Whether poses from files lie on the right instants, tested against how the object moved.

A tracker that saw every second image and numbered what it wrote, or began late, or stamped with another
clock, gives poses that are good, each for another moment. The recording knows how its object moved, from
the truth or from the visual poses that it has, and other readings of numbers and stamps are tried as
other units are.
"""

from __future__ import annotations

from dataclasses import dataclass

import gtsam
import numpy as np

from ...exceptions import RecordingError
from ..recording import Recording
from ..trajectory import PoseTrajectory
from .files import PoseFiles
from .formats import Frame
from .motion import MOST_POSES, Fit, Points, clearly_better, tracked_points
from .numbering import Numbering, possible_numberings, usual_numbering

FAR = 3  # [images], numberings that differ by more are different ones, not one seen with some delay
MOST_FIRSTS = 500  # begins that are tried for each stride
LONGEST_SHIFT = 1.0  # [s]
SHIFT_STEP = 0.02  # [s], halved around the best
LEAST_SHIFT = 0.015  # [s], less is a matter of the exposure
NEARER = 0.85  # of the error as read; a tracker that lost the object follows nothing better
WRONG_SHIFT = 0.1  # [s], more is no tracker's own delay


@dataclass(frozen=True, eq=False)
class Known:
    """What the recording knows of its object's motion.

    Attributes:
        what: Where from, in words.
        trajectory: The object's poses T_wo.
        points_o: Points of it that are compared [m], shape (J, 3).
    """

    what: str
    trajectory: PoseTrajectory
    points_o: np.ndarray

    def at(self, times: np.ndarray, frame: Frame, recording: Recording) -> list[gtsam.Pose3 | None]:
        """Poses at instants [s] in the world or in the frame of the camera, None where not known."""
        poses = self.trajectory.at(times)
        if frame == "world":
            return poses
        cameras = [recording.camera_pose_at(time) for time in times.tolist()]
        pairs = zip(cameras, poses, strict=True)
        return [None if T_wc is None or T is None else T_wc.between(T) for T_wc, T in pairs]


def known_motion(recording: Recording) -> Known | None:
    """How the object moved, as far as the recording says."""
    for what, trajectory in (
        ("the true pose", recording.ground_truth),
        ("the recorded visual pose", recording.visual_poses),
    ):
        if trajectory is not None and len(trajectory) > 1:
            return Known(what, trajectory, tracked_points(recording.object))
    return None


def find_numbering(
    files: PoseFiles, recording: Recording, image_times: np.ndarray, known: Known | None
) -> Numbering:
    """Which images the numbers mean: what they say of themselves, unless the object moved otherwise.

    Args:
        files: Poses with numbers, in the right unit and frame.
        recording: What they are to be put into.
        image_times: Instants of its images [s], shape (M,).
        known: How its object moved, or None.

    Raises:
        RecordingError: Another reading fits clearly better, or several are possible and nothing tells
            which is right; it says what to type.
    """
    assert files.table.images is not None
    if files.numbering is not None:
        return files.numbering
    numbers, count = files.table.images, len(image_times)
    usual = usual_numbering(numbers, count, files.path)
    options = list(possible_numberings(numbers, count))
    if usual.in_order or len(options) == 1:
        return usual
    about = (
        f"{files.path} numbers {len(numbers)} poses {numbers.min()} to {numbers.max()}, the recording "
        f"has {count} images"
    )
    fits = None if known is None else _Fits(files, recording, image_times, known)
    if fits is not None:
        best = min(_thinned(options, usual), key=lambda n: fits.of(n).score)
        best = min((n for n in options if _near(n, best)), key=lambda n: fits.of(n).score)
        if best != usual and fits.better(best, usual, centred=True):
            raise RecordingError(
                f"{about}: read as {usual} they are {_mm(fits.of(usual))} from {fits.known.what}, as "
                f"{best} {_mm(fits.of(best))} (root mean square); give {best.options()} if that is what they "
                f"are, or {usual.options()} if not"
            )
    rivals = _rivals(numbers, count, usual)
    undecided = [r for r in rivals if fits is None or not fits.better(usual, r, centred=False)]
    if undecided:
        raise RecordingError(
            f"{about}, and nothing in it tells which they are: {usual}, or {undecided[0]}; "
            f"say it with {usual.options()} or {undecided[0].options()} (--first: the image of the "
            "first pose, counted from 0; --every: images from one number to the next)"
        )
    return usual


def _thinned(options: list[Numbering], usual: Numbering) -> list[Numbering]:
    step = {n.every: 0 for n in options}
    for option in options:
        step[option.every] += 1
    return [n for n in options if n == usual or n.first % -(-step[n.every] // MOST_FIRSTS) == 0]


def _near(a: Numbering, b: Numbering) -> bool:
    return a.every == b.every and abs(a.first - b.first) <= FAR


def _rivals(numbers: np.ndarray, count: int, usual: Numbering) -> list[Numbering]:
    """Other readings that people's programs write, far from the usual one."""
    low, span = int(numbers.min()), int(numbers.max() - numbers.min())
    if low > 1:  # whoever numbers from 100 on means image 100
        return []
    rivals = [Numbering(0)] if low == 1 and usual.first == 1 else []  # counted from 1
    rivals += [Numbering(0, every) for every in (2, 3) if span and every * span < count]
    late = count - 1 - span  # the last pose is of the last image
    return rivals + ([Numbering(late)] if late - usual.first > FAR else [])


class _Fits:
    """How well each reading of the numbers fits, computed once."""

    def __init__(
        self, files: PoseFiles, recording: Recording, image_times: np.ndarray, known: Known
    ) -> None:
        assert files.table.images is not None
        self.known = known
        self._numbers = files.table.images
        self._chosen = _spread(len(self._numbers))
        self._poses = Points.of(files.poses)[self._chosen]
        self._images = Points.of(known.at(image_times, files.frame, recording))
        self._fits: dict[Numbering, Fit] = {}

    def of(self, numbering: Numbering) -> Fit:
        if numbering not in self._fits:
            images = numbering.images(self._numbers)[self._chosen]
            self._fits[numbering] = Fit.of(self._poses, self._images[images], self.known.points_o)
        return self._fits[numbering]

    def better(self, a: Numbering, b: Numbering, centred: bool) -> bool:
        return clearly_better(self.of(a), self.of(b), self.known.points_o, centred)


def check_shift(
    files: PoseFiles, recording: Recording, times: np.ndarray, known: Known
) -> list[str]:
    """A sentence where the poses follow the object some hundredths of a second early or late.

    Args:
        files: Poses in the right unit and frame.
        recording: What they are to be put into.
        times: The instants they are of, as read [s], shape (N,).
        known: How its object moved.

    Raises:
        RecordingError: They are so early or late that no tracker's own delay explains it.
    """
    chosen = _spread(len(times))
    poses, times = Points.of(files.poses)[chosen], times[chosen]
    shifts = np.arange(-LONGEST_SHIFT, LONGEST_SHIFT + SHIFT_STEP / 2, SHIFT_STEP)

    def fit(shift: float) -> Fit:
        reference = Points.of(known.at(times - shift, files.frame, recording))
        return Fit.of(poses, reference, known.points_o)

    fits = {float(shift): fit(float(shift)) for shift in shifts}
    near = min(fits, key=lambda shift: fits[shift].score)
    fits |= {near + step: fit(near + step) for step in (-SHIFT_STEP / 2, SHIFT_STEP / 2)}
    best = min(fits, key=lambda shift: fits[shift].score)
    as_read = fit(0.0)
    if (
        not LEAST_SHIFT <= abs(best) < LONGEST_SHIFT - SHIFT_STEP
    ):  # at the end of what is tried: no best
        return []
    nearer = fits[best].error < NEARER * as_read.error
    if not nearer or not clearly_better(fits[best], as_read, known.points_o, True):
        return []
    words = (
        f"the poses follow {known.what} better {abs(best):.2f} s "
        f"{'earlier' if best > 0 else 'later'} ({_mm(fits[best])} instead of {_mm(as_read)} root mean square)"
    )
    why = (
        "are the stamps of another clock" if files.numbering is None else "are they of these images"
    )
    latency = f"--latency {files.latency + best:.2f}"
    if abs(best) >= WRONG_SHIFT:
        raise RecordingError(
            f"{files.path}: {words}; {why}? Give {latency}, or "
            f"--latency {files.latency:g} if they are right as they are"
        )
    return [f"{words}; if the tracker stamps when it is done, give {latency}"]


def _spread(count: int) -> np.ndarray:
    """Some of ``count`` poses, evenly."""
    chosen = np.linspace(0, count - 1, min(count, MOST_POSES))
    return np.unique(np.rint(chosen).astype(np.int64))


def _mm(fit: Fit) -> str:
    return f"{1e3 * fit.error:.1f} mm"
