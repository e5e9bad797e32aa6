#!/usr/bin/env bash
# clang-tidy over all C++ files. See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
usage() {
  cat <<'EOF'
Usage: scripts/tidy.sh [--again] [PART...]

Runs clang-tidy with the checks of .clang-tidy over all C++ files of the project and prints what it finds; ends with 1 where
that is anything. PART: only files with this in their path, such as src/dmslam/map or tracker.cc.

Files are checked many at a time, since most of the time goes into the headers of Eigen and OpenCV: some 20 minutes of one
core for all of them, 4 GB of memory. What was checked is kept in build/dev/tidy, so that a run that was stopped goes on where
it was, and is checked again when one of its files or headers has changed. --again: begins anew.
Needs clang and clang-tidy (apt-get install clang clang-tidy), and what scripts/setup.sh test installs.
EOF
}
again=0 parts=()
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --again) again=1 ;;
    -*) echo "tidy.sh: unknown option $1" >&2; usage >&2; exit 2 ;;
    *) parts+=("$1") ;;
  esac
  shift
done
cd "$top"
for tool in clang++ clang-tidy cmake ninja; do
  command -v "$tool" >/dev/null || { echo "tidy.sh: $tool is missing; run scripts/setup.sh test and apt-get install clang clang-tidy" >&2; exit 1; }
done
log=$(mktemp)
trap 'rm -f "$log"' EXIT
{ cmake --preset dev -DDMSLAM_BUILD_TESTS=ON && ninja -C build/dev dmslam_lcmtypes_headers; } >"$log" 2>&1 || { cat "$log" >&2; exit 1; }
if ((again)); then rm -rf build/dev/tidy; fi
python3 scripts/lib/tidy.py "$top" "$top/build/dev" ${parts[@]+"${parts[@]}"}
