#!/usr/bin/env bash
# Installs what is missing, builds, and runs all tests: scripts/test.sh [ctest options, as -R NAME]. Works from any folder.
# Tests that need the kitchen sequences look for them in $DMSLAM_DATA (default: ../shared/data) and say so without them.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
case "${1:-}" in
  -h | --help) sed -n '2,3s/^# //p' "$0"; exit 0 ;;
esac
"$top/scripts/setup.sh" test
echo "building (some minutes the first time) ..." >&2
"$top/scripts/build.sh" --tests release
# One more at a time than there are cores: tests of processes spend part of their time waiting.
exec ctest --test-dir "$top/build/release" --output-on-failure -j "${DMSLAM_JOBS:-$(($(nproc) + 1))}" "$@"
