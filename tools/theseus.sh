#!/bin/sh
# Makes the virtual environment $THESEUS in which the benchmarks run Theseus, apart from the project's own.
# Its wheels are for old Pythons, so it is installed from source; scikit-sparse is wanted by a solver not used here.
set -eu
PYTHON=${PYTHON:-python3}
THESEUS=${THESEUS:-.venv-theseus}

[ -x "$THESEUS/bin/python" ] || "$PYTHON" -m venv "$THESEUS"
echo "theseus: installing PyTorch and Theseus into $THESEUS (half a minute, 1.2 GB)"
pip() { "$THESEUS/bin/python" -m pip install -q --disable-pip-version-check "$@"; }
pip torch==2.13.0 setuptools wheel numpy scipy lxml pyyaml
pip --no-build-isolation --no-deps theseus-ai==0.2.3 torchlie==0.1.0 torchkin==0.1.1 urdf-parser-py==0.0.4
"$THESEUS/bin/python" -W ignore -c 'import theseus' ||
    { echo "theseus: installed, but it does not import" >&2; exit 1; }
