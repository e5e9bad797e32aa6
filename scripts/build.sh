#!/usr/bin/env bash
# Builds where something has changed; says nothing where nothing is to do. See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
usage() {
  cat <<'EOF'
Usage: scripts/build.sh [--tests] [PRESET] [TARGET...]

Configures build/PRESET (default: release) where it is not there and builds the targets (default: all of it).
--tests: with the tests (needs scripts/setup.sh test); without it a new folder is configured without them.
EOF
}
tests=""
case "${1:-}" in
  -h | --help) usage; exit 0 ;;
  --tests) tests=ON; shift ;;
  -*) echo "build.sh: unknown option $1" >&2; usage >&2; exit 2 ;;
esac
preset=${1:-release}
[ $# -gt 0 ] && shift
cd "$top"
for tool in cmake ninja; do
  command -v "$tool" >/dev/null || { echo "build.sh: $tool is missing; run scripts/setup.sh core" >&2; exit 1; }
done
folder=build/$preset
mkdir -p "$folder"
exec 9>"$folder/.lock"
flock 9  # two runs that start together build once
log=$(mktemp)
trap 'rm -f "$log"' EXIT

has_tests() { grep -q '^DMSLAM_BUILD_TESTS:BOOL=ON' "$folder/CMakeCache.txt"; }
if [ ! -f "$folder/build.ninja" ]; then
  cmake --preset "$preset" -DDMSLAM_BUILD_TESTS="${tests:-OFF}" >"$log" 2>&1 || { cat "$log" >&2; exit 1; }
elif [ -n "$tests" ] && ! has_tests; then
  cmake --preset "$preset" -DDMSLAM_BUILD_TESTS=ON >"$log" 2>&1 || { cat "$log" >&2; exit 1; }
fi
# A target that is not there may be one whose packages were missing when the folder was configured.
for target in "$@"; do
  ninja -C "$folder" -t query "$target" >/dev/null 2>&1 && continue
  cmake --preset "$preset" >"$log" 2>&1 || { cat "$log" >&2; exit 1; }
  break
done

ninja=(ninja -C "$folder" -j "${DMSLAM_JOBS:-$(nproc)}" "$@")
if [ -t 2 ]; then
  "${ninja[@]}" -n 2>/dev/null | tail -n 1 | grep -q 'no work to do' || "${ninja[@]}" >&2
else
  "${ninja[@]}" >"$log" 2>&1 || { grep -vE '^(\[[0-9]+/[0-9]+\] (Building|Linking|Generating)|ninja: Entering)' "$log" | tail -n 80 >&2; exit 1; }
fi
