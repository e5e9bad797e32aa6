#!/usr/bin/env bash
# Prints config/population_rendered.txt: what dmslam-synth is asked for, from consecutive seeds, none of them picked:
# scripts/population_rendered.sh >config/population_rendered.txt
set -euo pipefail
case "${1:-}" in
  -h | --help) sed -n '2,3s/^# //p' "$0"; exit 0 ;;
esac
readonly FIRST_SEED=1 LAST_SEED=48 FRAMES=400

state=0
# Sets `drawn` to a number from 0 to N - 1, by SplitMix64 (Steele, Lea, Flood 2014): the same with every shell.
draw() { # N
  state=$((state + 0x9E3779B97F4A7C15))
  local z=$state
  z=$(((z ^ ((z >> 30) & 0x3FFFFFFFF)) * 0xBF58476D1CE4E5B9))
  z=$(((z ^ ((z >> 27) & 0x1FFFFFFFFF)) * 0x94D049BB133111EB))
  drawn=$((((z ^ (z >> 31)) & 0x7FFFFFFF) % $1))
}
pick() { # WORD...: sets `picked`
  draw $#
  shift "$drawn"
  picked=$1
}

describe() { # SEED: prints its options
  local path scene options share thing
  state=$1
  pick xyz rpy halfsphere turn tour forward ring
  path=$picked
  case $path in
    ring) scene=corridor ;;
    forward) pick room office hall workshop corridor; scene=$picked ;;
    *) pick room office hall workshop aliased; scene=$picked ;;
  esac
  options="--scene $scene --path $path"
  pick walk stop-and-go sit
  options+=" --behaviour $picked"
  draw 9
  share=$((15 + 5 * drawn))
  options+=" --moving-share 0.$share"
  for thing in carry cart screen; do
    draw 3
    ((drawn)) || options+=" --$thing"
  done
  draw 3
  ((drawn)) || [[ $scene == aliased ]] || options+=" --door"
  printf '%s' "$options"
}

echo "# Rendered sequences: half name options of dmslam-synth. Written by scripts/population_rendered.sh from seeds"
echo "# $FIRST_SEED to $LAST_SEED, none of them picked: change the script, not this file."
for ((seed = FIRST_SEED; seed <= LAST_SEED; ++seed)); do
  half=develop
  ((seed % 2)) || half=report
  printf '%s r%02d --seed %d --frames %d %s\n' "$half" "$seed" "$seed" "$FRAMES" "$(describe "$seed")"
done
