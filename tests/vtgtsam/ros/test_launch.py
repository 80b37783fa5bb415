# SPDX-License-Identifier: MIT
"""The launch file starts a command line that exists; a stand-in reads it, since the package index has no launch."""

from __future__ import annotations

import runpy
import sys
from types import ModuleType, SimpleNamespace

import pytest
from typer.testing import CliRunner

from vtgtsam.cli import app
from vtgtsam.extras import install_line


@pytest.fixture
def launched(monkeypatch):
    """Runs the launch file with some arguments; the command that it executes."""
    given = {}

    class Configuration:
        def __init__(self, name):
            self._name = name

        def perform(self, context):
            return given[self._name]

    def declare(name, default_value, description):
        given.setdefault(name, default_value)

    actions = {
        "DeclareLaunchArgument": declare,
        "ExecuteProcess": lambda **arguments: SimpleNamespace(**arguments),
        "OpaqueFunction": lambda function: function,
    }
    modules = {
        "launch": {"LaunchDescription": lambda entries: entries},
        "launch.actions": actions,
        "launch.substitutions": {"LaunchConfiguration": Configuration},
    }
    for name, members in modules.items():
        module = ModuleType(name)
        module.__dict__.update(members)
        monkeypatch.setitem(sys.modules, name, module)

    def run(**arguments):
        given.update(arguments)
        file = CliRunner().invoke(app, ["ros", "--launch-file"]).stdout.strip()
        *_, node = runpy.run_path(file)["generate_launch_description"]()
        return node(None)[0]

    return run


def test_it_gives_the_options_that_are_set_and_starts_again(launched):
    process = launched(topics="map.yaml", record="run.mcap", use_sim_time="True", namespace="/left")
    assert process.cmd == [
        *("vtgtsam", "ros", "--topics", "map.yaml", "--record", "run.mcap"),
        *("--ros-args", "-r", "__ns:=/left", "-p", "use_sim_time:=true"),
    ]
    assert process.respawn and process.respawn_delay > 1.0


def test_its_options_are_those_of_the_command(launched):
    names = {"topics", "hand", "object", "calibration", "config", "record"}
    process = launched(view="true", **{name: "X" for name in names})
    usage = CliRunner().invoke(app, ["ros", "--help"]).stdout
    options = {
        word for word in process.cmd[: process.cmd.index("--ros-args")] if word.startswith("--")
    }
    assert options == {f"--{name}" for name in names} | {"--view"}
    assert all(option in usage for option in options)


def test_the_message_package_is_whole():
    folder = CliRunner().invoke(app, ["ros", "--messages"]).stdout.strip()
    from pathlib import Path

    files = {str(file.relative_to(folder)) for file in Path(folder).rglob("*") if file.is_file()}
    assert {"package.xml", "CMakeLists.txt", "msg/TactilePads.msg"} <= files
    built = (Path(folder) / "CMakeLists.txt").read_text(encoding="utf-8")
    assert '"msg/TactilePads.msg"' in built


def test_without_rclpy_the_command_says_what_to_do(monkeypatch):
    monkeypatch.setitem(sys.modules, "rclpy", None)
    from vtgtsam.exceptions import LiveError

    result = CliRunner().invoke(app, ["ros"])
    assert isinstance(result.exception, LiveError)
    assert f"source your ROS's setup.bash, or {install_line('ros')}" in str(result.exception)
