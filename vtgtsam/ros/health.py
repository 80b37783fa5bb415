# SPDX-License-Identifier: MIT
"""How the node and each of its topics are, in words that name what to look at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

from ..live.fusion import LATENCY, Fused, Fusion
from ..live.inputs import STREAMS, Inputs
from ..live.rate import Rate
from ..live.recorder import Recorder
from ..live.slots import NamedSlots, PoseSlot
from .intake import Intake
from .publisher_clock import PublisherClock

SILENT = 0.5  # [s]
MANY = 0.1  # share of a stream's values that are refused because others of the same instant or later were there


class Level(IntEnum):
    """As in diagnostic_msgs/msg/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass
class Condition:
    """How one part is.

    Attributes:
        name: The part.
        level: How bad.
        message: In words.
        values: Numbers and names to it.
    """

    name: str
    level: Level = Level.OK
    message: str = ""
    values: dict[str, str] = field(default_factory=dict)

    def say(self, level: Level, message: str) -> None:
        """Add a sentence; the worst level counts."""
        self.level = max(self.level, level)
        self.message = f"{self.message}; {message}" if self.message else message


@dataclass
class Link:
    """A topic as the ROS graph has it.

    Attributes:
        intake: What takes its messages.
        needed: What a silence of it means: ERROR where nothing can be fused without it; None where it may be absent.
        type: The type it was subscribed with, "" where it is not subscribed yet.
        publishers: Names of the nodes that publish it.
        problem: Why it cannot be subscribed.
    """

    intake: Intake
    needed: Level | None
    type: str = ""
    publishers: tuple[str, ...] = ()
    problem: str = ""


class TopicHealth:
    """Judges one stream by its topic and its samples.

    Args:
        stream: Its name.
        link: Its topic.
        inputs: Where its samples are, but for the camera's pose.
        pose: The poses of something that may stand still, hand or camera: it need not say so again.
    """

    def __init__(
        self, stream: str, link: Link, inputs: Inputs, pose: Callable[[], PoseSlot] | None = None
    ) -> None:
        self._stream, self._link, self._inputs, self._pose = stream, link, inputs, pose
        self._rate = Rate()
        self._before = (0, 0)  # taken, refused, at the last judgement

    def judge(self, now: float) -> Condition:
        """How the stream is at a time [s]."""
        link, inputs, stream = self._link, self._inputs, self._stream
        condition = Condition(f"vtgtsam: {stream}")
        sampled = stream in STREAMS
        silence = inputs.silence(stream) if sampled else link.intake.silence()
        condition.values = {
            "topic": link.intake.topic,
            "type": link.type,
            "publishers": ", ".join(link.publishers) or "none",
            "rate [Hz]": f"{self._rate.update(now, link.intake.messages):.1f}",
            "age [s]": f"{silence:.3f}",
            "messages": str(link.intake.messages),
            "unusable": str(link.intake.unusable),
        }
        stands = self._pose is not None and link.intake.messages > 0 and not self._pose().moves
        if link.problem:
            condition.say(Level.ERROR, link.problem)
        elif link.needed is not None and silence > SILENT and not stands:
            condition.say(link.needed, self._silence(silence))
        self._judge_messages(condition)
        if sampled:
            condition.values["refused"] = str(inputs.refused(stream))
            self._judge_names(condition)
            self._judge_samples(condition)
        if not condition.message:
            condition.message = "fine" if link.intake.messages else "nothing has come"
        return condition

    def _silence(self, silence: float) -> str:
        link = self._link
        left = "" if link.publishers else ", no publisher is there"
        if link.intake.messages == 0:
            return f"nothing has come on {link.intake.topic}{left}"
        means = {
            "joints": "nothing is fused until they come again",
            "contacts": "nothing is fused until they come again",
            "vision": "touch and the hand's shape go on alone",
            "hand_pose": "the hand is taken to stand where it was",
            "camera_pose": "the camera is taken to stand where it was",
            "depth": "touch and the hand's shape go on alone",
        }
        return f"{link.intake.topic} is silent for {silence:.1f} s{left}: {means[self._stream]}"

    def _judge_names(self, condition: Condition) -> None:
        slot = getattr(self._inputs, self._stream)
        if not isinstance(slot, NamedSlots) or self._link.intake.messages == 0:
            return
        with self._inputs.changed:
            missing, newest = slot.missing(), slot.latest_ns
            behind = [] if newest is None else slot.behind(newest - round(SILENT * 1e9))
        if missing:
            condition.say(Level.ERROR, f"never came: {', '.join(missing)}")
        if behind:
            condition.say(
                Level.ERROR,
                f"behind the others by more than {SILENT:g} s: {', '.join(behind)}; nothing is fused until they come "
                "again",
            )

    def _judge_messages(self, condition: Condition) -> None:
        intake = self._link.intake
        if intake.unusable:
            condition.say(
                Level.WARN,
                f"{intake.unusable} of {intake.messages} messages could not be used, the last one {intake.why}",
            )

    def _judge_samples(self, condition: Condition) -> None:
        inputs = self._inputs
        guard = inputs.guards[self._stream]
        if guard.odd:
            condition.say(
                Level.WARN,
                f"{guard.odd} stamps were off, the last by {guard.apart:+.1f} s: are there two clocks?",
            )
        taken, refused = inputs.count(self._stream), inputs.refused(self._stream) - guard.odd
        more = taken - self._before[0], refused - self._before[1]
        self._before = taken, refused
        if more[1] > max(MANY * more[0], 1):
            condition.say(
                Level.WARN,
                "values come that are not newer than the ones before them: do two publishers send the same names?",
            )


class EstimateHealth:
    """Judges the estimate."""

    def __init__(self, fusion: Fusion, clock: PublisherClock) -> None:
        self._fusion, self._clock = fusion, clock
        self._rate = Rate()
        self._last: tuple[int, float] = (
            0,
            float("-inf"),
        )  # frames, and when their number last grew [s]
        self.event = ""

    def judge(self, now: float) -> Condition:
        """How it is at a time [s]."""
        fusion = self._fusion
        if fusion.count != self._last[0]:
            self._last = fusion.count, now
        latest = fusion.latest
        condition = Condition("vtgtsam: estimate")
        condition.values = {
            "rate [Hz]": f"{self._rate.update(now, fusion.count):.1f}",
            "frames": str(fusion.count),
            "begun anew": str(fusion.started),
            "last event": self.event or "none",
            **self._latencies(),
        }
        if latest is None:
            condition.say(Level.WARN, "waiting for joints, contacts and a first visual pose")
            condition.values["status"] = "waiting"
            return condition
        condition.values |= _words(latest)
        if now - self._last[1] > SILENT:
            condition.say(Level.ERROR, f"nothing was fused for {now - self._last[1]:.1f} s")
        _judge_estimate(condition, latest)
        if self._clock.offset_ns:
            ahead = self._clock.offset_ns / 1e9
            condition.say(
                Level.WARN,
                f"stamps are by a clock {abs(ahead):.1f} s {'ahead of' if ahead > 0 else 'behind'} this one: a bag or "
                "simulator wants use_sim_time, two computers the same time",
            )
        return condition

    def _latencies(self) -> dict[str, str]:
        found = {}
        names = {
            LATENCY: "latency",
            "instant fused": "age of the instant",
            "image": "age of the image",
        }
        for name, shown in names.items():
            percentiles = self._fusion.latencies.percentiles(name)
            if percentiles is not None:
                p50, p95 = (1000 * x for x in percentiles[:2])
                found[f"{shown} p50, p95 [ms]"] = f"{p50:.1f}, {p95:.1f}"
        return found


def _words(fused: Fused) -> dict[str, str]:
    estimate = fused.estimate
    return {
        "status": estimate.status,
        "faults": ", ".join(estimate.faults) or "none",
        "mode": estimate.mode or "none",
        "contacts": str(int(fused.cut.contacts.sum())),
        "visual weight": f"{estimate.visual_weight:.3f}",
    }


def _judge_estimate(condition: Condition, fused: Fused) -> None:
    estimate = fused.estimate
    if estimate.status != "ok":
        level = (
            Level.ERROR if estimate.status in ("lost", "contradicted", "invalid") else Level.WARN
        )
        condition.say(level, estimate.status)
    if estimate.faults:
        condition.say(Level.WARN, ", ".join(estimate.faults))
    if not condition.message:
        condition.message = "ok"


def judge_recorder(recorder: Recorder) -> Condition:
    """How the recording is."""
    condition = Condition("vtgtsam: recording")
    try:
        recorder.check()
    except Exception as error:
        condition.say(Level.ERROR, str(error))
    else:
        condition.message = f"to {recorder.path}" if recorder.on else "off"
    return condition


def in_words(conditions: list[Condition]) -> str:
    """The conditions as a table in Markdown."""
    rows = ["| part | | rate [Hz] | age [s] | |", "|---|---|---|---|---|"]
    for c in conditions:
        level = "" if c.level is Level.OK else f"**{c.level.name}**"
        rate, age = (c.values.get(key, "") for key in ("rate [Hz]", "age [s]"))
        name = c.name.removeprefix("vtgtsam: ")
        rows.append(f"| {name} | {level} | {rate} | {age} | {c.message.replace('|', '/')} |")
    estimate = conditions[0].values
    shown = ("status", "mode", "faults", "contacts", "visual weight", "latency p50, p95 [ms]")
    said = [f"{key} **{estimate[key]}**" for key in shown if key in estimate]
    return " · ".join(said) + "\n\n" + "\n".join(rows)


def diagnostics_message(conditions: list[Condition], now: Any) -> Any:
    """A diagnostic_msgs/msg/DiagnosticArray; ``now`` is a builtin_interfaces/msg/Time."""
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

    message = DiagnosticArray()
    message.header.stamp = now
    for c in conditions:
        status = DiagnosticStatus(
            level=bytes([c.level]), name=c.name, message=c.message, hardware_id="vtgtsam"
        )
        status.values = [KeyValue(key=key, value=value) for key, value in c.values.items()]
        message.status.append(status)
    return message
