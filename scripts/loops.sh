#!/usr/bin/env bash
# Loop closing on rendered sequences, with and without. See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
out=$top/out/loops cache="" seeds=5 only="" baseline=1 build=$top/build/release failed=0
usage() {
  cat <<EOF
Usage: scripts/loops.sh [--out DIR] [--cache DIR] [--seeds N] [--only PATTERN] [--no-baseline] [--build-dir DIR]

Renders a ring of corridors, a tour of a room, and a tour of two rooms with the same things (aliased), with and without
walkers, seeds 1..N; plays each in lock-step with loop closing and with --no-loop, and writes DIR/table.md. What is done
is not done again: the same command continues.

  --out DIR         results (default: out/loops in the project)
  --cache DIR       rendered sequences (default: --out's folder 'sequences'); some 100 MB each
  --seeds N         default 5
  --only PATTERN    only runs whose name matches, as 'ring_*'
  --no-baseline     leave the runs with --no-loop out
  --build-dir DIR   where the programs are (default: build/release)
EOF
}
die() { echo "loops.sh: $*" >&2; exit 1; }
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --out | --cache | --seeds | --only) (($# > 1)) || die "$1 needs a value; see --help"; printf -v "${1#--}" %s "$2"; shift 2 ;;
    --no-baseline) baseline=0; shift ;;
    --build-dir) (($# > 1)) || die "$1 needs a value; see --help"; build=$2; shift 2 ;;
    *) die "unknown option $1; see --help" ;;
  esac
done
[[ $seeds =~ ^[1-9][0-9]*$ ]] || die "--seeds $seeds: write a number from 1 on"
[[ -n $cache ]] || cache=$out/sequences
bin=$build/bin
[[ -x $bin/dmslam-inprocess && -x $bin/dmslam-synth ]] || die "$bin has no dmslam-inprocess and dmslam-synth; build first"
mkdir -p -- "$out" "$cache" || die "$out or $cache cannot be made"

render() { # NAME SEED, options of dmslam-synth
  local name=$1 seed=$2
  shift 2
  [[ ! -e $cache/$name/done ]] || return 0
  echo "loops.sh: rendering $name" >&2
  "$bin/dmslam-synth" --quiet --gray --seed "$seed" "$@" --out "$cache/$name"
  touch "$cache/$name/done"
}
play() { # NAME VARIANT, options of dmslam-inprocess
  local folder=$out/$1/$2 name=$1
  shift 2
  [[ ! -e $folder/done ]] || return 0
  echo "loops.sh: $folder" >&2
  mkdir -p -- "$folder"
  "$bin/dmslam-inprocess" --sequence "$cache/$name" --camera "$cache/$name/camera.yaml" --out "$folder" "$@" \
    >"$folder/log.txt" 2>&1 || { echo "loops.sh: $folder failed; see its log.txt" >&2; failed=1; return 0; }
  touch "$folder/done"
}

for ((seed = 1; seed <= seeds; ++seed)); do
  for kind in ring tour aliased ringw tourw; do
    name=${kind}_$seed
    # shellcheck disable=SC2053
    [[ -z $only || $name == $only ]] || continue
    scene=() walkers=()
    case $kind in
      ring*) scene=(--path ring) ;;
      tour*) scene=(--path tour) ;;
      aliased) scene=(--path tour --scene aliased) ;;
    esac
    [[ $kind != *w ]] || walkers=(--moving-share 0.15)
    # Nobody walks in the corridors of 'ring': the plain start is enough, and it copes with walking straight ahead.
    profile=()
    [[ $kind != ring ]] || profile=(--profile baseline)
    render "$name" "$seed" "${scene[@]}" "${walkers[@]}"
    play "$name" loop "${profile[@]}"
    ((baseline == 0)) || play "$name" no-loop "${profile[@]}" --no-loop
  done
done
python3 "$top/scripts/loops_table.py" "$cache" "$out" >"$out/table.md"
cat "$out/table.md"
exit "$failed"
