#!/bin/sh
# Makes the virtual environment $VENV and installs the project with what its tests and demo need.
set -eu
PYTHON=${PYTHON:-python3}
VENV=${VENV:-.venv}

fail() { echo "setup: $*" >&2; exit 1; }

command -v "$PYTHON" >/dev/null 2>&1 || fail "no '$PYTHON' found; install Python 3.11 or newer, or call: make PYTHON=/path/to/python3.11"
"$PYTHON" -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
    fail "Python 3.11 or newer is needed, '$PYTHON' is $("$PYTHON" -V 2>&1); call: make PYTHON=/path/to/python3.11"

if ! "$PYTHON" -c 'import venv, ensurepip' 2>/dev/null; then
    # Debian ships these apart from Python itself.
    if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
        echo "setup: installing python3-venv"
        apt-get update -qq && apt-get install -y -qq python3-venv python3-pip
    else
        fail "Python's venv module is missing; type: sudo apt-get install python3-venv python3-pip"
    fi
fi

[ -x "$VENV/bin/python" ] || "$PYTHON" -m venv "$VENV"
echo "setup: installing vtgtsam and its dependencies into $VENV (2.5 GB; a minute or two on a fast line, else longer)"
"$VENV/bin/python" -m pip install --disable-pip-version-check -e '.[dev]'
