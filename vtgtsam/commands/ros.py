# SPDX-License-Identifier: MIT
"""``vtgtsam ros``: the ROS 2 node."""

from __future__ import annotations

import signal
import sys
import threading
from pathlib import Path
from typing import Annotated, Any

import typer

from .live_view import LOOPBACK, PORT, View, ViewHost, ViewPort, live_page
from .options import Calibration, Force, Hand, Object

_PACKAGE = Path(__file__).parents[1]
_LAUNCH_FILE = _PACKAGE / "ros" / "vtgtsam.launch.py"
_MESSAGES = _PACKAGE / "recording" / "msg" / "vtgtsam_msgs"
SWITCH = 0.0005  # [s], after which a computing thread lets others in; Python's 5 ms are long for a message


def ros(
    context: typer.Context,
    topics: Annotated[
        Path | None,
        typer.Option(help="Topic map (YAML), as for bags; else this package's own names."),
    ] = None,
    hand: Hand = None,
    object: Object = None,
    calibration: Calibration = None,
    calibrate: Annotated[
        bool, typer.Option("--calibrate", help="Calibrate camera and joints while it works.")
    ] = False,
    calibration_out: Annotated[
        Path | None,
        typer.Option(help="Calibrate while it works, and write what was found to this YAML file."),
    ] = None,
    force: Force = False,
    config: Annotated[
        str, typer.Option(help="Preset (simulation, real_world, tuned) or YAML file.")
    ] = "tuned",
    record: Annotated[
        Path | None,
        typer.Option(help="Record to this .mcap file, or to FILE_1.mcap, ... where it is there."),
    ] = None,
    launch_file: Annotated[
        bool, typer.Option("--launch-file", help="Only say where the launch file lies.")
    ] = False,
    messages: Annotated[
        bool,
        typer.Option(
            "--messages",
            help="Only say where the package with our own message lies, to be built by colcon.",
        ),
    ] = False,
    view: View = False,
    view_host: ViewHost = LOOPBACK,
    view_port: ViewPort = PORT,
) -> None:
    """Estimate the object's pose on a running robot: a ROS 2 node.

    It publishes ~/object_pose (PoseWithCovarianceStamped) until Ctrl-C. ROS's own arguments follow --ros-args; every
    option is a parameter, too.
    """
    from ..exceptions import LiveError
    from ..extras import install_line

    if launch_file or messages:
        typer.echo(_LAUNCH_FILE if launch_file else _MESSAGES)
        return
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        raise LiveError(
            f"the Python package rclpy of ROS 2 cannot be loaded ({error}): source your ROS's setup.bash, or "
            f"{install_line('ros')}"
        ) from None
    from ..ros.node import run
    from ..ros.settings import Given

    given = Given(
        topics=_text(topics),
        hand=hand or "",
        object=object or "",
        calibration=_text(calibration),
        calibrate=calibrate,
        calibration_out=_text(calibration_out),
        force=force,
        config=config,
        record=_text(record),
    )
    arguments = _ros_arguments(context.args)
    where = live_page(view, view_host, view_port, None, typer.echo)
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    sys.setswitchinterval(SWITCH)
    run(given, arguments, stop, where)


def _text(path: Any) -> str:
    return "" if path is None else str(path)


def _ros_arguments(arguments: list[str]) -> list[str]:
    """What follows the options, which must be ROS's own.

    Raises:
        BadParameter: It is something else.
    """
    if arguments and arguments[0] != "--ros-args":
        raise typer.BadParameter(
            f"{arguments[0]!r} is no option; ROS's own arguments follow --ros-args"
        )
    return arguments
