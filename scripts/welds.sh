#!/usr/bin/env bash
# Welds between cameras in rendered rooms, among them rooms that look alike: false ones and missed ones. See --help.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
me=welds
source "$root/scripts/lib/resumable.sh"
usage() {
  cat <<EOF
Usage: scripts/welds.sh [--out DIR] [--cache DIR] [--seeds N] [--only PATTERN]

Renders a tour of a room and one of two rooms with the same things (aliased), each with and without walkers, seeds 1..N, at
15 Hz. Each tour is split among cameras that set out together, and played in lock-step on one map:

  two         two cameras, of whose ways a fifth is the same
  twoagainst  the same, and the second goes its way backwards
  three       three, each of which has a fifth in common with the next
  five        five, every other one backwards
  apart       two that have no frame in common (two fifths of the tour each): in rooms that look alike, in one each

Writes DIR/table.md: how many cameras are in the common map in the end, how well they lie to one another, which of the welds
put places together that are apart by the truth (false), and which cameras are apart that are not to be (missed). A run is good
where neither is, each camera's error, all laid onto the truth by one similarity, is at most 0.3 % of the path, and no single
pose is off by more than ten times that (else it is OFF). With --seeds 3 there are 60 runs. What is done is not done again: the
same command continues. Ends with 1 where a run is not good.

  --out DIR         results (default: out/welds in the project)
  --cache DIR       rendered and split sequences (default: --out's folder 'sequences')
  --seeds N         default 3
  --only PATTERN    only runs whose name matches, as 'aliased_1_*'
EOF
}
folder=$root/out/welds cache="" seeds=3 only="*"
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --out | --cache | --seeds | --only)
      (($# > 1)) || die "$1 needs a value; see --help"
      case $1 in --out) folder=$2 ;; --cache) cache=$2 ;; --seeds) seeds=$2 ;; --only) only=$2 ;; esac
      shift 2
      ;;
    *) die "unknown option $1; see --help" ;;
  esac
done
[[ $seeds =~ ^[1-9][0-9]*$ ]] || die "--seeds $seeds: write a number from 1 on"
need_programs dmslam-synth dmslam-inprocess
work_in "$folder"
mkdir -p -- "${cache:=$out/sequences}" || die "$cache cannot be made"

render() { # NAME SEED KIND
  local options=(--path tour --fps 15 --speed 0.7 --frames 600)
  [[ $3 != aliased* ]] || options=(--path tour --fps 15 --speed 0.7 --frames 810 --scene aliased)
  [[ $3 != *w ]] || options+=(--moving-share 0.15)
  [[ ! -e $cache/$1/done ]] || return 0
  say "rendering $1"
  start "$bin/dmslam-synth" --quiet --gray --samples 1 --seed "$2" "${options[@]}" --out "$cache/$1"
  touch "$cache/$1/done"
}

# pieces SPLIT COUNT: what each camera plays of a tour of COUNT frames, "FIRST-LAST", backwards where FIRST is the larger.
pieces() {
  local cameras against=0 k length step first last
  case $1 in
    apart) echo "0-$(($2 * 2 / 5 - 1)) $(($2 / 2))-$(($2 * 9 / 10 - 1))"; return ;;
    two) cameras=2 ;;
    twoagainst) cameras=2 against=1 ;;
    three) cameras=3 ;;
    five) cameras=5 against=1 ;;
  esac
  length=$(($2 * 5 / (4 * cameras + 1))) step=$(($2 * 4 / (4 * cameras + 1)))
  for ((k = 0; k < cameras; ++k)); do
    first=$((k * step)) last=$((k * step + length - 1))
    if ((against && k % 2)); then echo "$last-$first"; else echo "$first-$last"; fi
  done
}

play() { # TOUR SPLIT
  local name=$1_$2 arguments=() count piece k=0 status=0
  # shellcheck disable=SC2053
  [[ $name == $only && ! -e $out/$name/summary.json && ! -e $out/$name/failed.txt ]] || return 0
  count=$(grep -vc '^#' "$cache/$1/rgb.txt")
  rm -rf -- "$out/$name.part"
  mkdir -p -- "$out/$name.part"
  for piece in $(pieces "$2" "$count"); do
    python3 "$root/scripts/rearrange.py" "$cache/$1" "$cache/${name}_$k" "$piece"
    arguments+=("$( ((k == 0)) && echo --sequence || echo --also)" "$cache/${name}_$k")
    k=$((k + 1))
  done
  say "$name"
  start "$bin/dmslam-inprocess" "${arguments[@]}" --camera "$cache/$1/camera.yaml" --out "$out/$name.part" \
    >"$out/$name.part/log.txt" 2>&1 || status=$?
  finish_run "$out/$name.part" "$out/$name" "$status" || say "$name failed; see $out/$name/failed.txt"
}

for ((seed = 1; seed <= seeds; ++seed)); do
  for kind in aliased tour aliasedw tourw; do
    tour=${kind}_$seed
    for split in two twoagainst three five apart; do
      # shellcheck disable=SC2053
      [[ ${tour}_$split == $only ]] || continue
      render "$tour" "$seed" "$kind"
      play "$tour" "$split"
    done
  done
done
status=0
python3 "$root/scripts/welds_table.py" "$cache" "$out" >"$out/table.md" || status=$?
cat "$out/table.md"
exit "$status"
