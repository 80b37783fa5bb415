# SPDX-License-Identifier: MIT
"""Which servo drives which joint, and how: one YAML file for each built hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from hardware.camera.wrist import TagMount
from hardware.tactile.wiring import PadWiring
from vtgtsam.exceptions import ConfigError
from vtgtsam.input.text import read_yaml

from .table import BAUD_CODES, MODELS, STATE, TICKS_PER_TURN, X330, Model

if TYPE_CHECKING:
    from vtgtsam import HandModel

DATA = Path(__file__).parents[1] / "data"

_TICK = 2 * math.pi / TICKS_PER_TURN  # [rad]
_ServoName = Literal["XL330-M288-T", "XC330-M288-T", "XC330-T288-T"]
_Name = Annotated[str, BeforeValidator(lambda name: str(name) if type(name) is int else name)]
_Gain = Annotated[int, Field(ge=0, le=X330["position_p_gain"].high)]


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Gains(_Model):
    """Position gains as the control table has them (not divided by anything)."""

    P: _Gain
    I: _Gain  # noqa: E741  (the manual's letter)
    D: _Gain


class Joint(_Model):
    """One joint and the servo that drives it.

    Attributes:
        name: The joint's name in the hand's model.
        id: The servo's id.
        sign: 1 where counts grow with the angle, -1 where they fall.
        zero: Count at angle zero.
        limits: Least and largest angle that may be commanded [rad].
        gains: Position gains.
        current: Largest current [A]; an XL330's stall current is 1.47 A, an XC330's 1.80 A.
        servo: The servo's model where it is not the hand's.
    """

    name: _Name
    id: int = Field(ge=0, le=X330["id"].high)
    sign: Literal[1, -1]
    zero: int = Field(ge=0, lt=TICKS_PER_TURN)
    limits: tuple[float, float]
    gains: Gains
    current: float = Field(default=0.3, gt=0)
    servo: _ServoName | None = None

    @model_validator(mode="after")
    def _check(self) -> Joint:
        low, high = self.limits
        if not -math.pi < low < high < math.pi:
            raise ValueError(
                f"limits must be [least, largest] within a turn [rad], got {low}, {high}"
            )
        return self

    def turns(self, ticks: float) -> int:
        """Whole turns by which a servo counts more than this file, which has ``zero`` in 0..4095.

        After power on a servo counts from 0 to 4095, wherever the joint's zero lies, and from there on beyond. Since
        the limits are less than a turn apart, only one turn brings a count near them.
        """
        middle = self.zero + self.sign * sum(self.limits) / 2 / _TICK
        return round((ticks - middle) / TICKS_PER_TURN)

    def angle(self, ticks: float) -> float:
        """Angle [rad] at a count, of the turn that brings it nearest to the limits."""
        return self.sign * (ticks - TICKS_PER_TURN * self.turns(ticks) - self.zero) * _TICK

    def ticks(self, angle: float, turns: int = 0) -> int:
        """Count nearest to an angle [rad] for a servo that counts so many turns more."""
        return round(self.zero + self.sign * angle / _TICK) + TICKS_PER_TURN * turns

    @property
    def label(self) -> str:
        """How messages call it."""
        return f"{self.name} (servo {self.id})"


class HandDescription(_Model):
    """A built hand.

    Attributes:
        hand: Its model, a name or path for ``vtgtsam.load_hand``; a path is relative to the file.
        grasp: How it closes, a name or path for ``vtgtsam.grasp.load_grasp``; ``hand`` where not given.
        servo: The servos' model.
        baud: The rate all servos are set to.
        watchdog: A servo stops by itself when it hears nothing for so long [s].
        max_step: Largest distance of a command from where the joint is [rad].
        max_speed: Speed to which the servos limit themselves [rad/s].
        patience: How long a cycle waits for answers beyond their time on the line [s].
        check_clocks: Whether an answer is refused that by the servo's own clock was made before the
            question, or after a restart.
        check_encoders: Whether a joint is refused that stands still though its motor turns.
        joints: The joints, in any order: they go by name.
        pads: How the pads are wired to the pad board; None for a hand without pads.
        wrist_tag: The AprilTag on the wrist; None for a hand without one.
    """

    hand: str
    grasp: str = ""
    servo: _ServoName = "XL330-M288-T"
    baud: int
    watchdog: float = Field(default=0.2, ge=0.04, le=2.54)
    max_step: float = Field(default=0.35, gt=0, le=1.0)
    max_speed: float = Field(default=5.5, gt=0, le=10.8)
    patience: float = Field(default=0.012, gt=0, le=0.1)
    check_clocks: bool = True
    check_encoders: bool = True
    joints: tuple[Joint, ...] = Field(min_length=1)
    pads: PadWiring | None = None
    wrist_tag: TagMount | None = None

    @model_validator(mode="after")
    def _check(self) -> HandDescription:
        if self.baud not in BAUD_CODES:
            raise ValueError(
                f"baud must be one of {', '.join(map(str, BAUD_CODES))}, got {self.baud}"
            )
        for what in ("name", "id"):
            values = [getattr(joint, what) for joint in self.joints]
            doubles = sorted({v for v in values if values.count(v) > 1})
            if doubles:
                raise ValueError(f"each joint needs its own {what}; given twice: {doubles}")
        for joint in self.joints:
            most = self.model(joint).largest_current / 1000
            if joint.current > most:
                raise ValueError(
                    f"{joint.label}: current must be at most {most} A for an {joint.servo or self.servo}, "
                    f"got {joint.current}"
                )
        return self

    def model(self, joint: Joint) -> Model:
        """The kind of servo that drives a joint."""
        return MODELS[joint.servo or self.servo]

    def model_name(self, joint: Joint) -> str:
        """What that kind is called."""
        return joint.servo or self.servo

    @property
    def cycle(self) -> float:
        """What one cycle of the loop takes on the line [s]: goals out, states back."""
        count = len(self.joints)
        reading = 14 + count + count * (11 + STATE.size)
        writing = 14 + count * 5
        return (reading + writing) * 10 / self.baud  # a start and a stop bit to each byte

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in order."""
        return tuple(joint.name for joint in self.joints)


def load_description(name_or_path: str | Path) -> HandDescription:
    """Read a hand's YAML file.

    Args:
        name_or_path: "isyhand", or the path of a file of the same form.

    Raises:
        ConfigError: There is no such file, or something in it is wrong.
    """
    path = description_path(name_or_path)
    if not path.exists():
        known = ", ".join(sorted(file.stem for file in DATA.glob("*.yaml")))
        raise ConfigError(f"no hand {str(name_or_path)!r}: give a .yaml file or one of: {known}")
    content = read_yaml(path, ConfigError)
    try:
        if not isinstance(content, dict):
            raise ConfigError(f"{path} must be a mapping as hardware/data/isyhand.yaml is")
        for key in ("hand", "grasp"):  # beside this file, or a name
            if isinstance(name := content.get(key), str) and (path.parent / name).is_file():
                content[key] = str(path.parent / name)
        return HandDescription.model_validate(content)
    except ValidationError as error:
        raise ConfigError(f"{path}: {_first_mistake(error)}") from error


def description_path(name_or_path: str | Path) -> Path:
    """The file of a hand given by name or path; it need not be there."""
    path = Path(name_or_path)
    return path if path.suffix in (".yaml", ".yml") else DATA / f"{name_or_path}.yaml"


def misfits(description: HandDescription, hand: HandModel) -> list[str]:
    """Where a built hand's file and the hand's model do not name the same joints and pads; empty where they do.

    Joints that the model couples to others need no servo.
    """
    found, here = [], set(description.joint_names)
    if unknown := [name for name in description.joint_names if name not in hand.joint_names]:
        found.append(
            f"no joints of the model: {', '.join(_suggest(n, hand.joint_names) for n in unknown)}"
        )
    needed = [name for name in hand.joint_names if name not in hand.coupled_joints]
    if missing := [name for name in needed if name not in here]:
        found.append(f"joints of the model without a servo: {', '.join(missing)}")
    if description.pads is not None:
        try:
            description.pads.input_of(hand.pad_names)
        except ConfigError as error:
            found.append(str(error))
    return found


def _suggest(name: str, names: Sequence[str]) -> str:
    alike = get_close_matches(name, names, 1)
    return f"{name} (is it {alike[0]}?)" if alike else name


def wiring_of(description: HandDescription) -> PadWiring:
    """The hand's pads.

    Raises:
        ConfigError: It has none.
    """
    if description.pads is None:
        raise ConfigError("the hand's file has no entry 'pads': see hardware/data/isyhand.yaml")
    return description.pads


def _first_mistake(error: ValidationError) -> str:
    """Where it is, what is expected, and what is there instead."""
    first = error.errors()[0]
    where = ".".join(str(part) for part in first["loc"])
    if first["type"] == "value_error":  # our own sentence, which says what it got
        return f"{where}: {first['ctx']['error']}" if where else str(first["ctx"]["error"])
    got = repr(first["input"])
    return f"{where}: {first['msg']}, got {got if len(got) < 60 else got[:57] + '...'}"
