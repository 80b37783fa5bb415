# SPDX-License-Identifier: MIT
"""A recorded sequence, and the estimator's measurements made from it."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar, overload

import gtsam
import numpy as np

from .. import limits
from ..exceptions import RecordingError, VtgtsamError
from ..input.plain import plain, sentence
from ..measurement import Measurement
from . import names
from .align import Streams, measurements_at
from .calibrations import Calibrations
from .camera_share import holds_camera
from .consistency import Evidence, Finding, check
from .named import NamedStream
from .poses import PoseStream
from .replay import replayed
from .trajectory import PoseTrajectory

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..hands.model import HandModel
    from ..objects import ObjectModel
    from .topics import Topics

T = TypeVar("T")

LONGEST_PAUSE_NS = 10 * 10**9  # [ns] without any joint angle or contact
MAX_NAMED_PAUSES = 3
_TOLD = ("hand", "object", "dataset", "tracker")  # of the metadata, where it is printed
_SHOWN = ("joints", "contacts", "hand_pose", "vision", "truth", "estimate")

_log = logging.getLogger(__name__)


class _TriedOnce:
    """Makes an object; where that fails it fails again in the same words, without computing for seconds once more."""

    def __init__(self, make: Callable[[], ObjectModel]) -> None:
        self._make = make
        self._failed: Exception | None = None

    def __call__(self) -> ObjectModel:
        if self._failed is not None:
            raise self._failed
        try:
            return self._make()
        except Exception as error:
            self._failed = error
            raise


class Recording:
    """A recorded sequence; ``read_recording`` makes it.

    Attributes:
        path: Where it was read from.
        info: Its metadata: hand, object, dataset, sequence, seed, noise_scale, tracker, version, ...
        topics: The names its streams were read under.
        warnings: Sentences on what could not be read or used; ``measurements`` may add to them.
    """

    def __init__(
        self,
        path: Path,
        info: dict[str, str],
        topics: Topics,
        streams: Streams,
        make_hand: Callable[[], HandModel],
        make_object: Callable[[], ObjectModel],
        present: dict[str, str],
        make_calibrations: Callable[[], Calibrations] = Calibrations,
    ) -> None:
        self.path = path
        self.info = info
        self.topics = topics
        self.warnings: list[str] = []
        self._streams = streams
        self._make_hand = make_hand
        self._make_object = _TriedOnce(make_object)
        self._make_calibrations = make_calibrations
        self._present = present  # type by topic, for error messages

    def __repr__(self) -> str:
        return f"Recording({str(self.path)!r})"

    def __str__(self) -> str:
        """What was recorded, of what, for how long, in a few lines."""
        about = [f"{key} {plain(self.info[key], 60)}" for key in _TOLD if self.info.get(key)]
        lines = [f"{self.path}: {', '.join(about)}" if about else str(self.path)]
        for name in _SHOWN:
            stream = getattr(self._streams, name)
            if stream is not None:
                times = stream.times_ns
                span = (int(times[-1]) - int(times[0])) / 1e9
                rate = f" in {span:.1f} s, {(len(times) - 1) / span:.0f} Hz" if span > 0 else ""
                lines.append(f"  {name.replace('_', ' ')}: {len(times)}{rate}")
        return "\n".join(lines)

    @cached_property
    def hand(self) -> HandModel:
        """The hand: as given, else as attached, else as named in the metadata."""
        return self._make_hand()

    @cached_property
    def object(self) -> ObjectModel:
        """The object: as given, else as attached, else as named in the metadata."""
        obj = self._make_object()
        recorded = self.info.get("object_sha256")
        if recorded and obj.sha256 and obj.sha256 != recorded:
            self.warn([f"the recording was made with another mesh of {self.info.get('object')!r}"])
        return obj

    @cached_property
    def findings(self) -> list[Finding]:
        """What does not fit where the streams are held against each other, hand and object.

        What needs a hand or an object that cannot be had is left out.
        """
        hand, obj = (self._had(make) for make in ("hand", "object"))
        evidence = Evidence(self._streams, self.topics, hand, obj, tuple(self._present))
        return check(evidence)

    def _had(self, name: str) -> Any:
        try:
            return getattr(self, name)
        except (VtgtsamError, ValueError, OSError):
            return None

    def measurements(
        self, rate: float | Literal["vision", "recorded"] = "vision"
    ) -> list[Measurement]:
        """The recording as the estimator wants it.

        Each stream is held at its last stamp; frames before the first joint, contact or hand pose
        are skipped with a warning. Whatever does not fit (``findings``) gets a warning too. A visual
        pose counts for a second at most.

        Args:
            rate: "vision": a frame at each visual pose; a number: so many frames a second [Hz];
                "recorded": a frame at each pose on /estimate/object_pose, as a live run had them: with what had
                been received by then, and each visual pose in the frame that fused it.

        Raises:
            RecordingError: A stream is missing, or one of the hand's joints or pads is.
        """
        joints = self._needed(self._streams.joints, self.topics.joints, "joint angles")
        contacts = self._needed(self._streams.contacts, self.topics.contacts.topic, "contacts")
        self._check_names(joints, self.hand.joint_names, self.topics.joints, "joints")
        self._check_names(contacts, self.hand.pad_names, self.topics.contacts.topic, "pads")
        instants_ns = self._instants(rate, joints, contacts)
        found: list[str] = []
        try:
            if rate == "recorded":
                hold_ns = self._vision_hold_ns()
                measurements = replayed(self._streams, self.hand, found, hold_ns)
            else:
                measurements = measurements_at(instants_ns, self._streams, self.hand, found)
        except RecordingError as error:
            raise RecordingError(f"{self.path}: {error}") from None
        self.warn([*(finding.sentence for finding in self.findings), *found])
        return measurements

    def _vision_hold_ns(self) -> int:
        text = self.info.get(names.VISION_HOLD)
        if text is None:
            return 0
        try:
            seconds = float(text)
        except ValueError:
            seconds = -1.0
        if not 0 <= seconds < 1e6:
            raise RecordingError(f"{names.VISION_HOLD} must be seconds, got {plain(repr(text))}")
        return round(seconds * 1e9)

    def _instants(
        self, rate: float | str, joints: NamedStream, contacts: NamedStream
    ) -> np.ndarray:
        if rate == "vision":
            vision = self._needed(self._streams.vision, self.topics.vision.topic, "visual poses")
            return vision.times_ns
        if rate == "recorded":
            estimate = self._needed(
                self._streams.estimate, self.topics.estimate, "a live run's estimates"
            )
            return estimate.times_ns
        if isinstance(rate, str) or not (np.isfinite(rate) and rate > 0):
            raise ValueError(f'rate must be "vision", "recorded" or a number above 0, got {rate!r}')
        start = max(joints.start_ns(self.hand.joint_names), contacts.start_ns(self.hand.pad_names))
        times: np.ndarray = np.union1d(joints.times_ns, contacts.times_ns)
        return self._grid(times[times >= start], rate)

    def _grid(self, times_ns: np.ndarray, rate: float) -> np.ndarray:
        """Instants [ns] at a rate [Hz] from the first time on; none while nothing at all was recorded."""
        if len(times_ns) == 0:
            return times_ns
        pauses = np.flatnonzero(np.diff(times_ns) > LONGEST_PAUSE_NS)
        self.warn(
            [
                f"nothing was recorded from {times_ns[i] / 1e9:.2f} to {times_ns[i + 1] / 1e9:.2f} s, so there are "
                "no frames in between; is a stamp wrong?"
                for i in pauses[:MAX_NAMED_PAUSES].tolist()
            ]
        )
        start = int(times_ns[0])
        firsts = np.ceil((times_ns[[0, *(pauses + 1)]] - start) * (rate / 1e9))
        lasts = np.floor((times_ns[[*pauses, -1]] - start) * (rate / 1e9))
        frames = float(np.maximum(lasts - firsts + 1, 0).sum())
        most = limits.FRAMES + limits.FRAMES_PER_MESSAGE * len(times_ns)
        limits.check(frames, most, f"frames at {rate:g} Hz in {self.path}", RecordingError)
        counts = [np.arange(a, b + 1) for a, b in zip(firsts, lasts, strict=True)]
        steps_ns: np.ndarray = np.rint(np.concatenate(counts) * (1e9 / rate)).astype(np.int64)
        return start + steps_ns

    @property
    def streams(self) -> Streams:
        """The streams as they were read, each with its own instants."""
        return self._streams

    @property
    def span(self) -> tuple[float, float]:
        """First and last instant of its streams [s]; a constant camera pose has none."""
        s = self._streams
        streams = (s.joints, s.contacts, s.hand_pose, s.vision, s.truth, s.estimate)
        times = [stream.times_ns for stream in streams if stream is not None]
        if not times:
            return float("nan"), float("nan")
        return min(int(t[0]) for t in times) / 1e9, max(int(t[-1]) for t in times) / 1e9

    @cached_property
    def ground_truth(self) -> PoseTrajectory | None:
        """The object's true poses T_wo, or None where they were not recorded."""
        return _trajectory(self._streams.truth)

    @overload
    def truth_at(self, times: float) -> gtsam.Pose3 | None: ...

    @overload
    def truth_at(self, times: Sequence[float] | np.ndarray) -> list[gtsam.Pose3 | None]: ...

    def truth_at(
        self, times: float | Sequence[float] | np.ndarray
    ) -> gtsam.Pose3 | list[gtsam.Pose3 | None] | None:
        """True poses T_wo at given instants [s], interpolated; None where they are not known.

        One instant gives one pose, several give a list.

        Raises:
            RecordingError: The recording has no truth.
            ValueError: The instants are no numbers.
        """
        truth = self._needed(self.ground_truth, self.topics.truth, "true poses")
        return truth.at(times)

    @cached_property
    def visual_poses(self) -> PoseTrajectory | None:
        """What the visual tracker reported, T_wo at the true instants, or None."""
        return _trajectory(self._streams.vision)

    @cached_property
    def estimates(self) -> PoseTrajectory | None:
        """What a live run estimated, T_wo, or None."""
        return _trajectory(self._streams.estimate)

    @cached_property
    def calibrations(self) -> Calibrations:
        """What a live run corrected its measurements with; those of the recording are uncorrected.

        Raises:
            RecordingError: One of them cannot be read.
        """
        return self._make_calibrations()

    @property
    def covariance_holds_camera(self) -> bool:
        """Whether the file's visual covariances hold, beside the tracker's own, the camera's calibration error.

        So do those of simulated recordings from before the metadata said ``visual_covariance: tracker``. It was taken
        off when they were read: ``measurements`` and ``streams`` have the tracker's own.
        """
        return holds_camera(self.info)

    @property
    def camera_pose(self) -> gtsam.Pose3 | None:
        """The camera's first known pose T_wc, or None."""
        stream = self._streams.camera_pose
        return None if stream is None else stream.poses[0]

    def camera_pose_at(self, time: float) -> gtsam.Pose3 | None:
        """The camera's pose T_wc at an instant [s], the last one known then, or None."""
        stream = self._streams.camera_pose
        if stream is None:
            return None
        index = int(stream.held(np.array([round(time * 1e9)]))[0])
        return stream.poses[index] if index >= 0 else None

    def warn(self, sentences: list[str]) -> None:
        """Note what is wrong, each sentence once, and log it."""
        for told in map(sentence, sentences):
            if told not in self.warnings:
                self.warnings.append(told)
                _log.warning("%s: %s", self.path, told)

    def _needed(self, stream: T | None, topic: str, what: str) -> T:
        if stream is not None:
            return stream
        if topic in self._present:
            raise RecordingError(f"{self.path}: topic {topic} holds no usable message ({what})")
        tracker = self.info.get("tracker")
        if tracker and topic == self.topics.vision.topic:
            raise RecordingError(
                f"{self.path}: its tracker ({tracker}) never had a pose, so there is nothing on {topic}; leave the "
                "recording out, or put other poses into it with `vtgtsam attach-vision`"
            )
        others = ", ".join(f"{name} ({kind})" for name, kind in sorted(self._present.items()))
        raise RecordingError(
            f"{self.path} has no topic {topic} ({what}); it has: {others or 'nothing'}. "
            "Where another topic holds it, say so in a topic map (--topics)"
        )

    def _check_names(
        self, stream: NamedStream, needed: Sequence[str], topic: str, what: str
    ) -> None:
        missing = [name for name in needed if name not in stream.columns]
        if missing:
            raise RecordingError(
                f"{self.path}: topic {topic} lacks the hand's {what} {', '.join(missing)}; "
                f"it has {', '.join(sorted(stream.columns))}{_naming(len(missing), len(needed))}"
            )


def _naming(missing: int, needed: int) -> str:
    """What to do where none of the names is there."""
    if missing < needed:
        return ""
    return ". Names must be the same in both: change them in a copy of the hand's file, or where they are sent"


def _trajectory(stream: PoseStream | None) -> PoseTrajectory | None:
    if stream is None:
        return None
    return PoseTrajectory(stream.times_ns / 1e9, tuple(stream.poses))
