#!/bin/sh
# Makes the virtual environment $ROS with the genuine rclpy beside the project, apart from the project's own, for `make test-ros`.
set -eu
PYTHON=${PYTHON:-python3}
ROS=${ROS:-.venv-ros}

# The package index has ROS for these; a robot with a ROS of its own needs none of this.
"$PYTHON" -c 'import platform, sys; sys.exit(not ((3, 11) <= sys.version_info[:2] <= (3, 13) and platform.machine() == "x86_64"))' ||
    { echo "ros: the rclpy of the package index is for Python 3.11 to 3.13 on x86-64, '$PYTHON' is $("$PYTHON" -V 2>&1)" >&2; exit 1; }
[ -x "$ROS/bin/python" ] || "$PYTHON" -m venv "$ROS"
echo "ros: installing vtgtsam with rclpy into $ROS (270 MB for ROS, 1.5 GB in all; a minute or two)"
"$ROS/bin/python" -m pip install -q --disable-pip-version-check -e '.[ros,sim,viz]' 'pytest>=8'
