#!/usr/bin/env bash
# Builds what is needed and plays a sequence through the real processes: dmslam-run --help has the options, all of which
# this takes too, and --build-dir DIR, with which nothing is built.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build="" viewer=0 arguments=()
while (($#)); do
  case $1 in
    --build-dir)
      (($# > 1)) || { echo "run.sh: --build-dir needs a value (see --help)" >&2; exit 64; }
      build=$2
      shift 2
      continue
      ;;
    --viewer | --http) viewer=1 ;;
  esac
  arguments+=("$1")
  shift
done
if [[ -z $build ]]; then
  build=$top/build/release
  "$top/scripts/build.sh" release dmslam-{run,player,frontend,mapper,loopcloser,collector,map} >&2 ||
    { echo "run.sh: the build failed; its log is above" >&2; exit 1; }
  ((viewer == 0)) || "$top/scripts/build.sh" release dmslam-viewer >&2 ||
    { echo "run.sh: the viewer could not be built; scripts/setup.sh viewer installs what it needs" >&2; exit 1; }
fi
[[ -x $build/bin/dmslam-run ]] ||
  { echo "run.sh: $build/bin has no dmslam-run; build first, or leave --build-dir out" >&2; exit 1; }
exec "$build/bin/dmslam-run" "${arguments[@]}"
