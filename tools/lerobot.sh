#!/bin/sh
# Makes the virtual environment $LEROBOT with the genuine LeRobot beside the project, apart from the project's own, for
# `make test-lerobot`: it wants Python 3.12 or newer and its own bounds on NumPy and Rerun.
set -eu
PYTHON=${PYTHON:-python3.12}
LEROBOT=${LEROBOT:-.venv-lerobot}

"$PYTHON" -c 'import sys; sys.exit(sys.version_info < (3, 12))' 2>/dev/null ||
    { echo "lerobot: LeRobot is for Python 3.12 and newer, '$PYTHON' is not such a Python: make test-lerobot PYTHON12=/path/of/python3.12" >&2; exit 1; }
[ -x "$LEROBOT/bin/python" ] || "$PYTHON" -m venv "$LEROBOT"
echo "lerobot: installing LeRobot, PyTorch and the core of vtgtsam into $LEROBOT (6 GB; several minutes)"
"$LEROBOT/bin/python" -m pip install -q --disable-pip-version-check -e . 'lerobot[dataset]>=0.4' 'pytest>=8'
"$LEROBOT/bin/python" -c 'import lerobot' ||
    { echo "lerobot: installed, but it does not import" >&2; exit 1; }
