# SPDX-License-Identifier: MIT
"""How a result was made: settings, versions, commands."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from ... import limits
from ...config import PRESETS
from ...exceptions import ConfigError
from ...input.door import reading
from ...input.text import parse_yaml, read_bytes
from .. import store
from ..methods import stored_config

_PACKAGES = ("gtsam", "numpy", "scipy", "pandas", "pyarrow", "matplotlib")


@dataclass(frozen=True)
class Made:
    """How a result was made.

    Attributes:
        code: Version of the code that made the estimates.
        versions: Of Python and packages that made the page, by name.
        commands: What to type for the same again.
        settings: Of each method what differs from the recommended settings, as "name = value"; None
            where its settings are of another version and cannot be compared.
        config: The effective configuration as YAML.
    """

    code: str
    versions: dict[str, str]
    commands: list[str]
    settings: dict[str, list[str] | None]
    config: str


def how_made(out: Path) -> Made:
    """Read it from a run's folder. Nothing in it depends on when, where or in how many processes."""
    text, config = "", {}
    if _has_config(out):
        content = read_bytes(out / store.CONFIG, limits.TEXT_BYTES)
        text = content.decode("utf-8", errors="replace")
        config = parse_yaml(content, str(out / store.CONFIG))
    config = config if isinstance(config, dict) else {}
    methods = config.get("methods")
    methods = methods if isinstance(methods, dict) else {}
    with reading(out / store.CONFIG, ConfigError):
        return _made(text, config, methods)


def _made(text: str, config: dict[str, Any], methods: dict[str, Any]) -> Made:
    evaluate = f"vtgtsam evaluate RECORDINGS --out DIR --methods {','.join(methods)}"
    return Made(
        str(config.get("version", "unknown")),
        {"Python": platform.python_version(), **_versions()},
        [
            f"{evaluate} --config {_preset(methods) or 'config_of_one_method.yaml'}"
            + _given(config),
            "vtgtsam report DIR",
        ],
        {name: _differences(of_method) for name, of_method in methods.items()},
        text,
    )


def _has_config(out: Path) -> bool:
    return (out / store.CONFIG).is_file()


def _preset(methods: dict[str, Any]) -> str | None:
    """The preset that all methods' settings are, if there is one."""
    for name, preset in PRESETS.items():
        if methods and all(
            stored_config(settings) == preset().model_copy(update={"method": method})
            for method, settings in methods.items()
        ):
            return name
    return None


def _differences(settings: dict[str, Any]) -> list[str] | None:
    config = stored_config(settings)
    if config is None:
        return None
    found = config.differences()
    return [f"{name} = {_value(found[name])}" for name in found if name != "method"]


def _value(value: Any) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(map(_value, value))})"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _given(config: dict[str, Any]) -> str:
    options = {"hand": config.get("hand"), "object": config.get("object")}
    words = [f" --{name} {value}" for name, value in options.items() if value]
    return "".join(words) + (" --topics MAP.yaml" if config.get("topics") else "")


def _versions() -> dict[str, str]:
    found = {}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found
