# SPDX-License-Identifier: MIT
"""Launch the node, and launch it again if it dies: ``ros2 launch FILE topics:=map.yaml record:=run.mcap``.

A node that comes again begins anew at the next visual pose, and records to the next free name. ``vtgtsam ros
--launch-file`` says where this file lies.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration

OPTIONS = {
    "topics": "Topic map (YAML)",
    "hand": "Hand instead of the map's",
    "object": "Object instead of the map's",
    "calibration": "The robot's calibration, as vtgtsam calibrate writes it",
    "config": "Preset (simulation, real_world, tuned) or YAML file",
    "record": "Record to this .mcap file",
}
AGAIN_AFTER = 5.0  # [s]


def generate_launch_description():
    """The arguments, and the node."""
    arguments = [
        DeclareLaunchArgument(name, default_value="", description=text)
        for name, text in OPTIONS.items()
    ]
    more = [
        DeclareLaunchArgument("program", default_value="vtgtsam", description="Its program"),
        DeclareLaunchArgument("namespace", default_value="/", description="Its namespace"),
        DeclareLaunchArgument("use_sim_time", default_value="false", description="Follow /clock"),
        DeclareLaunchArgument("view", default_value="false", description="Serve the live page"),
    ]
    return LaunchDescription([*arguments, *more, OpaqueFunction(function=_node)])


def _node(context):
    def said(name):
        return LaunchConfiguration(name).perform(context)

    command = [said("program"), "ros"]
    for name in OPTIONS:
        if said(name):
            command += [f"--{name}", said(name)]
    if said("view").lower() == "true":
        command.append("--view")
    command += ["--ros-args", "-r", f"__ns:={said('namespace')}"]
    command += ["-p", f"use_sim_time:={said('use_sim_time').lower()}"]
    return [
        ExecuteProcess(
            cmd=command, output="screen", respawn=True, respawn_delay=AGAIN_AFTER, emulate_tty=True
        )
    ]
