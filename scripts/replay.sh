#!/usr/bin/env bash
# Record with lcm-logger, replay with lcm-logplayer: is it the same run? See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
out=$top/out/replay data=${DMSLAM_DATA:-$top/../shared/data} build=$top/build/release runs=3 speed=1
usage() {
  cat <<EOT
Usage: scripts/replay.sh [--out DIR] [--data DIR] [--runs N] [--speed X] [--build-dir DIR]

N times (default 3): runs kitchen in real time with the real lcm-logger beside it, then has the real lcm-logplayer feed the
log's camera channels to new processes. Prints the medians, and ends with 1 unless the replayed run tracks as much (within
2 points) as well (ATE within 0.010 m). What is done in DIR is not done again. --speed: of recording, and so of the replay;
less than 1 for a machine that cannot keep up.
EOT
}
fail() { echo "replay.sh: $*" >&2; exit 1; }
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --out | --data | --runs | --speed | --build-dir)
      (($# > 1)) || fail "$1 needs a value (see --help)"
      name=${1#--}; printf -v "${name//-dir/}" %s "$2"; shift 2
      ;;
    *) fail "unknown option $1 (see --help)" ;;
  esac
done
[[ -d $data/kitchen ]] || fail "$data/kitchen is not there; set --data or DMSLAM_DATA"
run() { # FOLDER ARGUMENTS...
  local folder=$1; shift
  [[ -s $folder/summary.json ]] || "$top/scripts/run.sh" --build-dir "$build" --out "$folder" "$@" >&2
}
value() { sed -nE "s/^ *\"$2\": *([^,]*),?$/\1/p" "$1/summary.json" | head -n 1; }
median() { sort -g | awk '{ v[NR] = $1 } END { print v[int((NR + 1) / 2)] }'; }
for ((i = 1; i <= runs; ++i)); do
  run "$out/original_$i" --sequence "$data/kitchen" --camera "$top/config/kitchen.yaml" --speed "$speed" --record
  run "$out/replayed_$i" --replay "$out/original_$i/run.lcmlog"
done
of() { for ((i = 1; i <= runs; ++i)); do value "$out/$1_$i" "$2"; done | median; }
printf '%-34s %10s %10s\n' "median of $runs" original replayed
for key in tracked_online_percent tracked_percent ate_rmse_final ate_rmse_online frames_skipped; do
  printf '%-34s %10.4g %10.4g\n' "$key" "$(of original $key)" "$(of replayed $key)"
done
awk -v t="$(of original tracked_online_percent)" -v u="$(of replayed tracked_online_percent)" \
  -v a="$(of original ate_rmse_final)" -v b="$(of replayed ate_rmse_final)" 'BEGIN {
  good = (t - u <= 2 && u - t <= 2 && a - b <= 0.010 && b - a <= 0.010)
  print good ? "the same run: reached" : "MISSED: asked are 2 points of tracking and 0.010 m of ATE"
  exit !good
}'
