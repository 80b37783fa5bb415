# SPDX-License-Identifier: MIT
"""The methods compared: one name and one estimator configuration each."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

from ..config import PRESETS, EstimatorConfig, Method
from ..exceptions import ConfigError


def load_config(config: EstimatorConfig | str | os.PathLike[str]) -> EstimatorConfig:
    """A configuration as it is, a preset by its name, or one read from a YAML file.

    Raises:
        ConfigError: It is neither a preset nor a file, or the file is wrong.
    """
    if isinstance(config, EstimatorConfig):
        return config
    if not isinstance(config, str | os.PathLike):
        raise ConfigError(
            f"config must be an EstimatorConfig, a preset ({', '.join(PRESETS)}) or the path of a YAML file, "
            f"got {type(config).__name__}"
        )
    if str(config) in PRESETS:
        return PRESETS[str(config)]()
    if not Path(config).is_file():
        raise ConfigError(
            f"{str(config)!r} is neither a preset ({', '.join(PRESETS)}) nor a YAML file"
        )
    return EstimatorConfig.from_yaml(Path(config))


def stored_config(settings: Mapping[str, Any]) -> EstimatorConfig | None:
    """The settings that were stored, without those that are gone; None where a value would be refused now."""
    known = {
        name: value for name, value in settings.items() if name in EstimatorConfig.model_fields
    }
    try:
        return EstimatorConfig(**known)
    except ValueError:
        return None


def default_methods(config: str) -> list[str]:
    """The methods to compare where none are named: all, or the paper's where the settings are the paper's."""
    methods: tuple[str, ...] = get_args(Method)
    paper = config in ("simulation", "real_world")
    return [name for name in methods if not (paper and name.endswith("+mem"))]


def method_configs(names: Iterable[str], config: EstimatorConfig) -> dict[str, EstimatorConfig]:
    """Each named method's configuration: ``config`` with its ``method`` replaced.

    Raises:
        ValueError: As ``check_methods``.
    """
    if isinstance(names, str):
        raise ValueError(f"methods must be a list of names, got the text {names!r}: [{names!r}]")
    names = list(names)
    check_methods(names)
    return {name: config.model_copy(update={"method": name}) for name in names}


def check_methods(names: Sequence[str]) -> None:
    """Refuse names that no comparison can be made with.

    Raises:
        ValueError: No name is given, one is unknown, or one is given twice.
    """
    known = get_args(Method)
    unknown = [str(name) for name in names if name not in known]
    if unknown:
        raise ValueError(
            f"unknown methods: {', '.join(unknown)}; the known ones are: {', '.join(known)}"
        )
    if not names or len(set(names)) < len(names):
        raise ValueError(f"methods must be one or more different names, got {names}")
