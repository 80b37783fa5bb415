# SPDX-License-Identifier: MIT
"""The estimator's settings, with the paper's presets (table I) and our own."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple, TypedDict, Unpack

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from .atomic import write_text
from .exceptions import ConfigError
from .input.plain import plain
from .input.text import read_yaml

Method = Literal["vis", "vis+pen", "vis+tac+pen", "vis+tac+pen+mem"]
Solver = Literal["lm", "fixed-damping"]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
# 1 / sigma^2 with sigmas between a nanometre and a thousand kilometres: beyond, products of weights lose all digits.
Weight = Annotated[float, Field(ge=1e-12, le=1e18, allow_inf_nan=False)]
LogTheta = Annotated[float, Field(ge=-100, le=100, allow_inf_nan=False)]


class VisualWeight(NamedTuple):
    """Separate weights, since a radian and a metre are not the same size of error."""

    rotation: Weight  # [1/rad^2]
    translation: Weight  # [1/m^2]


if TYPE_CHECKING:
    GivenVisualWeight = float | tuple[float, float]
else:
    GivenVisualWeight = Weight | VisualWeight


class ModeSettings(NamedTuple):
    """How the object's pose in the hand changes in a mode, and how long errors of frames stay alike."""

    rotation: Positive  # [rad / sqrt(s)], random walk
    translation: Positive  # [m / sqrt(s)], random walk
    correlation: NotNegative  # [s], a frame counts as one of correlation / dt that say the same


class CameraSigma(NamedTuple):
    """Standard deviation of where the camera is believed to be, about each axis and along it."""

    rotation: NotNegative  # [rad]
    translation: NotNegative  # [m]


class Settings(TypedDict, total=False):
    """The fields of an ``EstimatorConfig``, so that editors and type checkers know what a preset can override."""

    method: Method
    solver: Solver
    iterations: int
    damping: float
    damping_max: float
    log_theta_vis: float
    log_theta_tac: float
    w_vis: float | tuple[float, float]
    use_visual_covariance: bool
    w_tac: float
    w_pen: float
    recover: bool
    joint_sigma: float
    camera_sigma: CameraSigma
    pad_sigma: float
    log_theta_vis_mem: float
    free: ModeSettings
    moving: ModeSettings
    held: ModeSettings
    held_pads: int
    held_speed: float
    refused_weight: float
    restart_after: float
    offsets_correlation: float


class EstimatorConfig(BaseModel):
    """Settings of a ``PoseEstimator``; the plain constructor gives the recommended ones.

    Cost: 1/2 sum rho(w ||r||^2) with Welsch's rho(e) = theta - theta exp(-e / theta) for the visual and
    the tactile terms, and no robust loss for penetration (paper, section III-E).

    In the recommended settings each weight is 1 / sigma^2 of an error that a robot really has, each theta a number of
    sigmas squared. So radians and metres are weighed apart, a visual pose's own uncertainty is on the same scale (and
    is used where it is known), and the covariance is one in rad and m. ``simulation`` and ``real_world`` are the
    paper's.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    method: Method = Field(
        default="vis+tac+pen+mem",
        description="which measurements are fused: vision, penetration, touch, and memory of the frames before",
    )
    solver: Solver = Field(
        default="lm",
        description="GTSAM's Levenberg-Marquardt, or steps of constant damping as Theseus takes",
    )
    iterations: int = Field(default=5, ge=1, le=1000, description="most iterations a frame")
    damping: Positive = Field(
        default=100.0,  # a thousandth of the visual translation weight
        description="damping lambda added to J'J; for lm its first value",
    )
    damping_max: Positive = Field(
        default=1e9,  # weights are about 1e6: at GTSAM's own 1e5 the damping does not shorten a step yet
        description="damping at which lm gives up a step",
    )
    log_theta_vis: LogTheta = Field(
        default=5.0,  # 12 sigmas: 21 degrees or 37 mm
        description="log of the visual Welsch loss's theta",
    )
    log_theta_tac: LogTheta = Field(
        default=3.4,  # 5.5 sigmas: a contact farther than 5 mm from the object is false
        description="log of the tactile Welsch loss's theta",
    )
    w_vis: GivenVisualWeight = Field(
        default=VisualWeight(rotation=1 / 0.03**2, translation=1 / 0.003**2),
        description="visual weight, one number or (rotation [1/rad^2], translation [1/m^2])",
    )
    use_visual_covariance: bool = Field(
        default=True,
        description="whether a visual pose's own covariance, where it brings one, replaces w_vis",
    )
    w_tac: Weight = Field(
        default=1 / 0.001**2,  # joint zeros, and an object that is not quite its mesh
        description="weight of each touching pad's distance [1/m^2]",
    )
    w_pen: Weight = Field(
        default=1 / 0.0005**2, description="weight of each pad's penetration [1/m^2]"
    )
    recover: bool = Field(
        default=True, description="whether a lost estimate starts again from vision"
    )

    joint_sigma: NotNegative = Field(
        default=math.radians(1.0),
        description="standard deviation of each joint's zero [rad]; 0: exact",
    )
    camera_sigma: CameraSigma = Field(
        default=CameraSigma(
            rotation=0.01, translation=0.0012
        ),  # 1 degree and 2 mm in any direction
        description="standard deviation of the camera's pose, about and along each axis",
    )
    pad_sigma: NotNegative = Field(
        default=0.0008,
        description="standard deviation of the pads' positions [m] where joints are not known; 0: exact",
    )

    log_theta_vis_mem: LogTheta = Field(
        default=3.0,  # 4.5 sigmas: memory can afford a tighter gate
        description="log of the visual Welsch loss's theta where there is memory",
    )
    free: ModeSettings = Field(
        default=ModeSettings(rotation=2.7, translation=0.11, correlation=0.0),
        description="no pad touches: random walk of the pose in the hand, correlation time of frames",
    )
    moving: ModeSettings = Field(
        default=ModeSettings(rotation=0.16, translation=0.0055, correlation=0.1),
        description="pads touch and move: random walk of the pose in the hand, correlation time of frames",
    )
    held: ModeSettings = Field(
        default=ModeSettings(rotation=0.022, translation=0.0011, correlation=0.5),
        description="held: random walk of the pose in the hand, correlation time of frames",
    )
    held_pads: int = Field(default=3, ge=1, description="fewest touching pads that hold an object")
    held_speed: Positive = Field(
        default=0.008, description="speed of the fastest pad below which an object is held [m/s]"
    )
    refused_weight: float = Field(
        default=0.1, gt=0, lt=1, description="visual weight below which vision counts as refused"
    )
    restart_after: NotNegative = Field(
        default=0.5, description="for how long vision is refused before it may take over again [s]"
    )
    offsets_correlation: NotNegative = Field(
        default=10.0,
        description="for how long pads err alike by the robot's offsets, beside images that err alike [s]",
    )

    @classmethod
    def simulation(cls, **overrides: Unpack[Settings]) -> EstimatorConfig:
        """The paper's settings for its simulation (table I); its weights are not given: 1, 1, 1."""
        return cls(**(_PAPER | overrides))

    @classmethod
    def real_world(cls, **overrides: Unpack[Settings]) -> EstimatorConfig:
        """The paper's settings for its real hand (table I); its weights are not given: 1, 1, 1."""
        return cls(**(_PAPER | _REAL_WORLD | overrides))

    @classmethod
    def tuned(cls, **overrides: Unpack[Settings]) -> EstimatorConfig:
        """The recommended settings, as the plain constructor gives them."""
        return cls(**overrides)

    def differences(self) -> dict[str, Any]:
        """Settings that are not the recommended ones, by name."""
        recommended = EstimatorConfig()
        return {name: value for name, value in self if value != getattr(recommended, name)}

    @property
    def memory(self) -> bool:
        """Whether the method remembers the frames before."""
        return self.method.endswith("+mem")

    @property
    def visual_log_theta(self) -> float:
        """Log theta of the visual Welsch loss in this method."""
        return self.log_theta_vis_mem if self.memory else self.log_theta_vis

    @property
    def visual_weights(self) -> VisualWeight:
        """``w_vis`` as a pair, whichever way it was given."""
        if isinstance(self.w_vis, tuple):
            return VisualWeight(*self.w_vis)
        return VisualWeight(self.w_vis, self.w_vis)

    @classmethod
    def from_yaml(cls, path: str | Path) -> EstimatorConfig:
        """Read settings from a YAML file; what it leaves out is as recommended, or as in the preset that it names.

        ``preset: simulation`` (or ``real_world``, ``tuned``) begins with that preset's settings.

        Raises:
            ConfigError: The file cannot be read, or names an unknown preset or setting or a wrong value.
        """
        if not isinstance(path, str | os.PathLike):
            raise ConfigError(
                f"settings are read from the path of a YAML file, got {type(path).__name__}"
            )
        settings = read_yaml(Path(path), ConfigError, "settings from ")
        if settings is None:
            settings = {}
        if not isinstance(settings, dict):
            raise ConfigError(
                f"{path}: expected a mapping of setting to value, got a {type(settings).__name__}"
            )
        preset = str(settings.pop("preset", "tuned"))
        if preset not in PRESETS:
            raise ConfigError(f"{path}: preset must be one of {', '.join(PRESETS)}, got {preset!r}")
        try:
            return PRESETS[preset](**{str(key): value for key, value in settings.items()})
        except ValidationError as error:
            raise ConfigError(f"{path}: {_sentence(error)}") from error

    def to_yaml(self, path: str | Path) -> None:
        """Write all settings to a YAML file that ``from_yaml`` reads back equal."""
        settings = {
            name: value._asdict() if hasattr(value, "_asdict") else value for name, value in self
        }
        write_text(Path(path), yaml.safe_dump(settings, sort_keys=False))


# Table I of the paper, and the literal reading of what it leaves open: no weights, no recovery, no covariances.
_PAPER: Settings = {
    "damping": 0.02,
    "damping_max": 1e5,
    "log_theta_vis": -6.5,
    "log_theta_tac": 0.0,
    "w_vis": 1.0,
    "use_visual_covariance": False,
    "w_tac": 1.0,
    "w_pen": 1.0,
    "recover": False,
    "method": "vis+tac+pen",
    "joint_sigma": 0.0,
    "camera_sigma": CameraSigma(rotation=0.0, translation=0.0),
    "pad_sigma": 0.0,
}
_REAL_WORLD: Settings = {"iterations": 2, "log_theta_vis": -5.0, "log_theta_tac": -7.5}

PRESETS = {
    "simulation": EstimatorConfig.simulation,
    "real_world": EstimatorConfig.real_world,
    "tuned": EstimatorConfig.tuned,
}

_RANGE = ("greater_than", "greater_than_equal", "less_than_equal", "finite_number")
_GONE = {"engine": "every frame is a graph that GTSAM's optimiser solves"}

_MUST_BE = {  # by the type of pydantic's error
    "greater_than": "above {gt:g}",
    "greater_than_equal": "at least {ge}",
    "less_than_equal": "at most {le}",
    "finite_number": "finite",
    "float_type": "a number",
    "float_parsing": "a number",
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "literal_error": "{expected}",
}


def _sentence(error: ValidationError) -> str:
    """What is wrong with each setting, in the words of the file."""
    known = ", ".join(EstimatorConfig.model_fields)
    faults = error.errors()
    parts = []
    for item in faults:
        name = str(item["loc"][0])
        if name in _GONE:
            parts.append(f"the setting {name!r} is gone, leave it out: {_GONE[name]}")
        elif item["type"] == "extra_forbidden":
            parts.append(f"unknown setting {plain(repr(name))} (known: {known})")
        elif name != "w_vis":
            parts.append(_fault(name, item))
    visual = [item for item in faults if item["loc"][0] == "w_vis"]
    if visual:
        parts.append(_visual_fault(visual))
    return "; ".join(parts)


def _visual_fault(items: list[ErrorDetails]) -> str:
    """What is wrong with ``w_vis``: pydantic lists the faults of each form it may have."""
    for item in items:
        if item["type"] in _RANGE:  # so the form was right
            names = {"0": "rotation", "1": "translation"}
            inner = [names.get(str(part), str(part)) for part in item["loc"][2:]]
            return _fault(".".join(["w_vis", *inner]), item)
    return f"w_vis must be one number, or two: rotation and translation, got {plain(repr(items[0]['input']))}"


def _fault(name: str, item: ErrorDetails) -> str:
    if item["type"] in _MUST_BE:
        must_be = _MUST_BE[item["type"]].format(**item.get("ctx", {}))
        return f"{name} must be {must_be}, got {plain(repr(item['input']))}"
    return f"{name}: {item['msg']}, got {plain(repr(item['input']))}"
