#!/usr/bin/env bash
# Builds the programs where something has changed: scripts/build.sh [preset] [target...]. Quiet where nothing is to do.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
preset=${1:-release}
[ $# -gt 0 ] && shift
cd "$top"
log=$(mktemp)
trap 'rm -f "$log"' EXIT
if [ ! -f "build/$preset/build.ninja" ]; then
  cmake --preset "$preset" >"$log" 2>&1 || { cat "$log"; exit 1; }
fi
if [ -t 1 ]; then
  cmake --build "build/$preset" -- "$@"
else
  cmake --build "build/$preset" -- "$@" >"$log" 2>&1 || { grep -vE '^\[[0-9]+/[0-9]+\]' "$log" | tail -n 60; exit 1; }
fi
