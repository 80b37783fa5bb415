#!/bin/sh
# Installs Chromium where it may: a test opens the report of an evaluation in it, and is skipped without it.
set -eu

command -v chromium >/dev/null 2>&1 && exit 0
if [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null 2>&1; then
    echo "browser: installing chromium, in which a test opens the report (half a minute, 400 MB)"
    apt-get update -qq && apt-get install -y -qq --no-install-recommends chromium >/dev/null && exit 0
    echo "browser: that failed; the test is skipped"
else
    echo "browser: no chromium, so a test is skipped; to have it, type: sudo apt-get install chromium"
fi
