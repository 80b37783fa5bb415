#!/bin/sh
# Builds sdist and wheel, checks them, and tries both in bare environments of each Python in $PYTHONS.
set -eu
PYTHONS=${PYTHONS:-python3}
OUT=${OUT:-dist}
HERE=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

set -- $PYTHONS
"$1" -m venv "$work/build"
"$work/build/bin/python" -m pip install --quiet --disable-pip-version-check build twine
rm -rf "$OUT"
"$work/build/bin/python" -m build --outdir "$OUT" "$HERE"
"$work/build/bin/python" -m twine check --strict "$OUT"/*

for python in $PYTHONS; do
    for file in "$OUT"/*.whl "$OUT"/*.tar.gz; do
        rm -rf "$work/bare"
        "$python" -m venv "$work/bare"
        "$work/bare/bin/python" -m pip install --quiet --disable-pip-version-check "$file"
        size=$(du -sm "$work/bare" | cut -f1)
        (cd "$work" && bare/bin/python -I "$HERE/tools/smoke.py")
        echo "wheel: $("$python" -V) with $(basename "$file"), the core in $size MB: well"
    done
    "$work/bare/bin/python" -m pip install --quiet --disable-pip-version-check "$(ls "$OUT"/*.whl)[all]"
    (cd "$work" && bare/bin/vtgtsam --version && bare/bin/python -I "$HERE/tools/smoke.py" all)
    echo "wheel: $("$python" -V) with the extra all, $(du -sm "$work/bare" | cut -f1) MB: well"
done
