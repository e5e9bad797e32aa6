#!/usr/bin/env bash
# Loses the camera on purpose and measures how it is found again. See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
out=$top/out/lost data=${DMSLAM_DATA:-$top/../shared/data} build=$top/build/release failed=0
usage() {
  cat <<EOF
Usage: scripts/lost.sh [--out DIR] [--data DIR] [--build-dir DIR]

Plays kitchen and kitchen_walk1 in lock-step with black-outs of one second at ten places, and with ten jumps of one
second, and writes DIR/table.md: how soon after a view that was mapped the camera was found again, and how well. A view is
mapped when a tracked frame from before the trouble lies within 0.3 m and 20 degrees of it by ground truth. What is done is
not done again.
EOF
}
die() { echo "lost.sh: $*" >&2; exit 1; }
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --out | --data) (($# > 1)) || die "$1 needs a value; see --help"; printf -v "${1#--}" %s "$2"; shift 2 ;;
    --build-dir) (($# > 1)) || die "$1 needs a value; see --help"; build=$2; shift 2 ;;
    *) die "unknown option $1; see --help" ;;
  esac
done
[[ -x $build/bin/dmslam-inprocess ]] || die "$build/bin has no dmslam-inprocess; build first"
[[ -d $data/kitchen ]] || die "$data/kitchen is not there; set --data or DMSLAM_DATA"
mkdir -p -- "$out" || die "$out cannot be made"

play() { # SEQUENCE VARIANT, options of dmslam-inprocess
  local folder=$out/$1_$2 sequence=$data/$1
  shift 2
  [[ ! -e $folder/done ]] || return 0
  echo "lost.sh: $folder" >&2
  mkdir -p -- "$folder"
  "$build/bin/dmslam-inprocess" --sequence "$sequence" --camera "$top/config/kitchen.yaml" --out "$folder" "$@" \
    >"$folder/log.txt" 2>&1 || { echo "lost.sh: $folder failed; see its log.txt" >&2; failed=1; return 0; }
  touch "$folder/done"
}
trouble() { # SEQUENCE FIRST STEP
  local black=() jump=() k from
  for ((k = 0; k < 10; ++k)); do
    from=$(($2 + k * $3))
    black+=(--black-out "$from,1")
    jump+=(--jump "$from,$((from + 31))")
  done
  play "$1" plain
  play "$1" black-out "${black[@]}"
  play "$1" jump "${jump[@]}"
}
trouble kitchen 120 88
trouble kitchen_walk1 110 58
{
  echo "| run | found within 10 frames | frames until found | error after [m] | error otherwise [m] | error without trouble [m] |"
  echo "|---|---|---|---|---|---|"
  python3 "$top/scripts/lost_table.py" "$data/kitchen" "$out/kitchen" 120 88
  python3 "$top/scripts/lost_table.py" "$data/kitchen_walk1" "$out/kitchen_walk1" 110 58
} >"$out/table.md"
cat "$out/table.md"
exit "$failed"
