#!/usr/bin/env bash
# Measures the static selection against masks and true poses: most tables of docs/dlrsac.md. See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
out=$top/out/static data=${DMSLAM_DATA:-$top/../shared/data} windows=400 pairs=200 starts=50
usage() {
  cat <<END
Usage: scripts/judge_static.sh [--out DIR] [--data DIR] [--windows N] [--pairs N] [--starts N]

Writes DIR/<sequence>_<table>.md and .json for kitchen_walk2, kitchen_walk1 and kitchen: windows behind the system's gates,
windows of the whole initialiser, single pairs with and without search window and orientation check, first maps of starts
spread over the sequence; and the parts of DLRSAC one by one on kitchen_walk2. A table that is there is not made again, whatever
its count; remove it to make it anew. At last prints all tables of DIR. docs/dlrsac.md says how its other
tables are made.

Uses the program in \$DMSLAM_BIN where that is set, else builds it.

  --out DIR     default: out/static in the project
  --data DIR    the sequences (default: \$DMSLAM_DATA, else ../shared/data)
  --windows N   windows per sequence (default $windows)
  --pairs N     pairs per sequence and gap (default $pairs)
  --starts N    start frames per sequence (default $starts)
END
}
die() { echo "judge_static: $*" >&2; exit 1; }
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --out | --data | --windows | --pairs | --starts)
      (($# > 1)) || die "$1 needs a value; see --help"
      printf -v "${1#--}" %s "$2"
      shift 2
      ;;
    *) die "unknown option $1; see --help" ;;
  esac
done
[[ -d $data/kitchen_walk2 ]] || die "$data/kitchen_walk2 is not there: give the sequences' folder with --data"
bin=${DMSLAM_BIN:-$top/build/release/bin}
[[ -n ${DMSLAM_BIN:-} ]] || "$top/scripts/build.sh" release dmslam-static
[[ -x $bin/dmslam-static ]] || die "$bin does not hold dmslam-static; build it or unset DMSLAM_BIN"
mkdir -p "$out"

table() { # SEQUENCE NAME ARGUMENTS...
  local file=$out/$1_$2
  if [[ -e $file.json ]]; then
    echo "judge_static: $1 $2 kept as it is, count $(sed -nE 's/^  "count": ([0-9]+),?$/\1/p' "$file.json")" >&2
    return 0
  fi
  echo "judge_static: $1 $2" >&2
  rm -f -- "$file.md"
  "$bin/dmslam-static" judge --sequence "$data/$1" --camera "$top/config/kitchen.yaml" \
    --out "$file.md" --json "$file.json" "${@:3}"
}
for sequence in kitchen_walk2 kitchen_walk1 kitchen; do
  [[ -d $data/$sequence ]] || continue
  table "$sequence" windows --table windows --count "$windows"
  table "$sequence" system --table system --count "$windows" --features 4000
  table "$sequence" starts --table starts --count "$starts" --features 4000
  table "$sequence" pairs --table pairs --count "$pairs"
  table "$sequence" pairs_without_window --table pairs --count "$pairs" --no-window
done
table kitchen_walk2 parts --table ablation --count "$pairs" --gaps 8
cat "$out"/*.md
