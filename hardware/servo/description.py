# SPDX-License-Identifier: MIT
"""Which servo drives which joint, and how: one YAML file for each built hand."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from hardware.camera.wrist import TagMount
from hardware.tactile.wiring import PadWiring
from vtgtsam.exceptions import ConfigError

from .table import BAUD_CODES, TICKS_PER_TURN, XL330

DATA = Path(__file__).parents[1] / "data"

_TICK = 2 * math.pi / TICKS_PER_TURN  # [rad]
_Gain = Annotated[int, Field(ge=0, le=XL330["position_p_gain"].high)]


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
        current: Largest current [A]; the stall current is 1.47 A.
    """

    name: str
    id: int = Field(ge=0, le=XL330["id"].high)
    sign: Literal[1, -1]
    zero: int = Field(ge=0, lt=TICKS_PER_TURN)
    limits: tuple[float, float]
    gains: Gains
    current: float = Field(default=0.3, gt=0, le=XL330["current_limit"].high / 1000)

    @model_validator(mode="after")
    def _check(self) -> Joint:
        low, high = self.limits
        if not -math.pi < low < high < math.pi:
            raise ValueError(
                f"limits must be [least, largest] within a turn [rad], got {low}, {high}"
            )
        return self

    def angle(self, ticks: float) -> float:
        """Angle [rad] at a count."""
        return self.sign * (ticks - self.zero) * _TICK

    def ticks(self, angle: float) -> int:
        """Count nearest to an angle [rad]."""
        return round(self.zero + self.sign * angle / _TICK)

    @property
    def label(self) -> str:
        """How messages call it."""
        return f"{self.name} (servo {self.id})"


class HandDescription(_Model):
    """A built hand.

    Attributes:
        hand: Its model, a name or path for ``vtgtsam.load_hand``.
        baud: The rate all servos are set to.
        watchdog: A servo stops by itself when it hears nothing for so long [s].
        max_step: Largest distance of a command from where the joint is [rad].
        max_speed: Speed to which the servos limit themselves [rad/s].
        patience: How long a cycle waits for answers beyond their time on the line [s].
        check_clocks: Whether an answer is refused that by the servo's own clock was made before the
            question, or after a restart.
        joints: The joints, in the order of the hand's model.
        pads: How the pads are wired to the pad board; None for a hand without pads.
        wrist_tag: The AprilTag on the wrist; None for a hand without one.
    """

    hand: str
    baud: int
    watchdog: float = Field(default=0.2, ge=0.04, le=2.54)
    max_step: float = Field(default=0.35, gt=0, le=1.0)
    max_speed: float = Field(default=5.5, gt=0, le=10.8)
    patience: float = Field(default=0.012, gt=0, le=0.1)
    check_clocks: bool = True
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
        return self

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
    path = Path(name_or_path)
    if path.suffix not in (".yaml", ".yml"):
        path = DATA / f"{name_or_path}.yaml"
    try:
        content = yaml.safe_load(path.read_text())
        return HandDescription.model_validate(content)
    except FileNotFoundError:
        known = ", ".join(sorted(file.stem for file in DATA.glob("*.yaml")))
        raise ConfigError(
            f"no hand {name_or_path!r}: give a .yaml file or one of: {known}"
        ) from None
    except yaml.YAMLError as error:
        raise ConfigError(f"{path} is not YAML: {error}") from error
    except ValidationError as error:
        raise ConfigError(f"{path}: {_first_mistake(error)}") from error


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
