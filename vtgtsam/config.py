# SPDX-License-Identifier: MIT
"""The estimator's settings, with the paper's presets (table I) and our own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import ErrorDetails

from .exceptions import ConfigError
from .input.plain import plain
from .input.text import read_yaml

Method = Literal["vis", "vis+pen", "vis+tac+pen"]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class VisualWeight(NamedTuple):
    """Separate weights, since a radian and a metre are not the same size of error."""

    rotation: Positive  # [1/rad^2]
    translation: Positive  # [1/m^2]


class EstimatorConfig(BaseModel):
    """Settings of a ``PoseEstimator``; the plain constructor gives the literal reading of the paper.

    Cost: 1/2 sum rho(w ||r||^2) with Welsch's rho(e) = theta - theta exp(-e / theta) for the visual and
    the tactile terms, and no robust loss for penetration (paper, section III-E).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    method: Method = Field("vis+tac+pen", description="which measurements are fused")
    solver: Literal["lm", "fixed-damping"] = Field(
        "lm",
        description="GTSAM's Levenberg-Marquardt, or steps of constant damping as Theseus takes",
    )
    iterations: int = Field(5, ge=1, le=1000, description="most iterations a frame")
    damping: Positive = Field(
        0.02, description="damping lambda added to J'J; for lm its first value"
    )
    log_theta_vis: Finite = Field(-6.5, description="log of the visual Welsch loss's theta")
    log_theta_tac: Finite = Field(0.0, description="log of the tactile Welsch loss's theta")
    w_vis: Positive | VisualWeight = Field(
        1.0, description="visual weight, one number or (rotation [1/rad^2], translation [1/m^2])"
    )
    use_visual_covariance: bool = Field(
        False,
        description="whether a visual pose's own covariance, where it brings one, replaces w_vis",
    )
    w_tac: Positive = Field(1.0, description="weight of each touching pad's distance [1/m^2]")
    w_pen: Positive = Field(1.0, description="weight of each pad's penetration [1/m^2]")
    recover: bool = Field(False, description="whether a lost estimate starts again from vision")
    engine: Literal["compiled", "gtsam"] = Field(
        "compiled",
        description="who takes the solver's steps: compiled code, or GTSAM's optimiser over the factor graph; "
        "the poses are the same, the first is several times faster",
    )

    @classmethod
    def simulation(cls, **overrides: Any) -> EstimatorConfig:
        """The paper's settings for its simulation (table I); its weights are not given: 1, 1, 1."""
        return cls(**overrides)

    @classmethod
    def real_world(cls, **overrides: Any) -> EstimatorConfig:
        """The paper's settings for its real hand (table I); its weights are not given: 1, 1, 1."""
        preset = {"iterations": 2, "log_theta_vis": -5.0, "log_theta_tac": -7.5}
        return cls(**(preset | overrides))

    @classmethod
    def tuned(cls, **overrides: Any) -> EstimatorConfig:
        """Our settings: each weight is 1 / sigma^2 of an error a robot really has, each theta a number of sigmas.

        So radians and metres are weighed apart, a visual pose's own uncertainty is on the same scale (and is
        used where it is known), and the covariance is one in rad and m. A lost estimate starts again from vision.
        """
        preset: dict[str, Any] = {
            "w_vis": VisualWeight(rotation=1 / 0.03**2, translation=1 / 0.003**2),
            "use_visual_covariance": True,
            "w_tac": 1 / 0.001**2,  # joint zeros, and an object that is not quite its mesh
            "w_pen": 1 / 0.0005**2,
            "log_theta_vis": 5.0,  # 12 sigmas: 21 degrees or 37 mm
            "log_theta_tac": 3.4,  # 5.5 sigmas: a contact farther than 5 mm from the object is false
            "damping": 100.0,  # a thousandth of the visual translation weight
            "recover": True,
        }
        return cls(**(preset | overrides))

    @property
    def visual_weights(self) -> VisualWeight:
        """``w_vis`` as a pair, whichever way it was given."""
        if isinstance(self.w_vis, VisualWeight):
            return self.w_vis
        return VisualWeight(self.w_vis, self.w_vis)

    @classmethod
    def from_yaml(cls, path: str | Path) -> EstimatorConfig:
        """Read settings from a YAML file; what it leaves out has its default.

        Raises:
            ConfigError: The file cannot be read, or names an unknown setting or a wrong value.
        """
        settings = read_yaml(Path(path), ConfigError, "settings from ")
        if settings is None:
            settings = {}
        if not isinstance(settings, dict):
            raise ConfigError(
                f"{path}: expected a mapping of setting to value, got a {type(settings).__name__}"
            )
        try:
            return cls(**{str(key): value for key, value in settings.items()})
        except ValidationError as error:
            raise ConfigError(f"{path}: {_sentence(error)}") from error

    def to_yaml(self, path: str | Path) -> None:
        """Write all settings to a YAML file that ``from_yaml`` reads back equal."""
        settings = self.model_dump()
        if isinstance(self.w_vis, VisualWeight):
            settings["w_vis"] = {
                "rotation": self.w_vis.rotation,
                "translation": self.w_vis.translation,
            }
        Path(path).write_text(yaml.safe_dump(settings, sort_keys=False), encoding="utf-8")


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
        if item["type"] == "extra_forbidden":
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
        if item["type"] in ("greater_than", "finite_number"):  # so the form was right
            names = {"0": "rotation", "1": "translation"}
            inner = [names.get(str(part), str(part)) for part in item["loc"][2:]]
            return _fault(".".join(["w_vis", *inner]), item)
    return f"w_vis must be one number, or two: rotation and translation, got {plain(repr(items[0]['input']))}"


def _fault(name: str, item: ErrorDetails) -> str:
    if item["type"] in _MUST_BE:
        must_be = _MUST_BE[item["type"]].format(**item.get("ctx", {}))
        return f"{name} must be {must_be}, got {plain(repr(item['input']))}"
    return f"{name}: {item['msg']}, got {plain(repr(item['input']))}"
