#!/usr/bin/env bash
# How many of the sequences of a population succeed: people composited into a recording, and rendered rooms. See --help.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root me=population
# shellcheck source-path=SCRIPTDIR source=lib/resumable.sh
source "$root/scripts/lib/resumable.sh"
readonly MAX_FAILURES_IN_A_ROW=5

shared=${DMSLAM_SHARED:-$root/../shared}
out=$root/out/population/dm sequences=$root/out/population/sequences data=${DMSLAM_DATA:-$root/../shared/data}
half=develop profile=dm seed=1 jobs=1 run=1 details='' lists=() only=() settings=() compare=()

usage() {
  cat <<END
Usage: population.sh [--half develop] [--out DIR] [options]

Makes the sequences of one half of the population where they are not there, runs each in one process, in lock-step, and
writes DIR/HALF.md and DIR/HALF.json: the share that succeeds, ATE, wrong poses, false loops, wrong first maps and the time
to the first map, by how much of the image people cover. docs/evaluation.md says what counts as a success.
Composited sequences need \$DMSLAM_SHARED (default: ../shared), which holds population/grid.txt and tools/add_people.py, and
the kitchen. Stopped at any time, the same command continues.

  --half HALF      develop (default), report or known; the report half shows no single sequence: it is not there to tune on
  --out DIR        one folder per run, and the tables (default: out/population/dm in the project)
  --sequences DIR  where sequences are made; several DIRs of runs may share it (default: out/population/sequences)
  --list FILE      lines of a composited or a rendered sequence; may be repeated (default: population/grid.txt of
                   \$DMSLAM_SHARED, config/population_known.txt and config/population_rendered.txt)
  --only WHICH     composited, rendered, or the name of a sequence; may be repeated
  --profile NAME   dm (default), baseline or paper
  --seed N         of the runs (default 1)
  --set KEY=VALUE  a setting of the runs; may be repeated
  --jobs N         so many runs at a time (default 1)
  --compare NAME=DIR  another DIR of such runs beside these in the tables; may be repeated
  --details        also show the single sequences of the report half
  --report-only    write the tables from the runs that are there
  --data DIR       folder that holds the kitchen (default: \$DMSLAM_DATA, else ../shared/data)
  --help           this text
END
}

parse() {
  while (($#)); do
    case $1 in
      --help | -h) usage; exit 0 ;;
      --report-only) run=0; shift; continue ;;
      --details) details=1; shift; continue ;;
      --half | --out | --sequences | --list | --only | --profile | --seed | --set | --jobs | --compare | --data) ;;
      *) die "unknown argument $1; see --help" ;;
    esac
    (($# > 1)) || die "$1 needs a value; see --help"
    case $1 in
      --list) lists+=("$2") ;;
      --only) only+=("$2") ;;
      --set) settings+=("$2") ;;
      --compare) compare+=("$2") ;;
      *) printf -v "${1#--}" %s "$2" ;;
    esac
    shift 2
  done
  [[ " develop report known " == *" $half "* ]] || die "--half $half: choose develop, report or known"
  [[ $seed =~ ^[0-9]{1,9}$ ]] || die "--seed $seed: write a number"
  [[ $jobs =~ ^[1-9][0-9]?$ ]] || die "--jobs $jobs: write a number from 1 to 99"
  if ((${#lists[@]} == 0)); then
    lists=("$root/config/population_known.txt" "$root/config/population_rendered.txt")
    if [[ -r $shared/population/grid.txt ]]; then
      lists+=("$shared/population/grid.txt")
    else
      say "$shared/population/grid.txt is not there: without its sequences; set DMSLAM_SHARED"
    fi
  fi
}

# Whether --only names the sequence or its kind; without --only all are wanted.
is_wanted() { # NAME KIND
  ((${#only[@]} > 0)) || return 0
  local which
  for which in "${only[@]}"; do
    [[ $which != "$1" && $which != "$2" ]] || return 0
  done
  return 1
}

# One line per sequence of the half: name, kind, and the arguments of the program that makes it.
plan() {
  local list of name rest fields
  for list in "${lists[@]}"; do
    [[ -r $list ]] || die "$list cannot be read"
    while read -r of name rest; do
      [[ $of == "$half" ]] || continue
      if [[ $rest == --* ]]; then
        ! is_wanted "$name" rendered || printf '%s\t%s\t%s\n' "$name" rendered "$rest"
        continue
      fi
      read -ra fields <<<"$rest"
      ((${#fields[@]} == 7)) ||
        die "$list: $name: write half, name, seed, actors, pause, distance, amplitude, first and last; or half, name and options"
      is_wanted "$name" composited || continue
      printf '%s\t%s\t--seed %s --actors %s%s --distance %s --amplitude %s --first %s --last %s\n' "$name" composited \
        "${fields[0]}" "${fields[1]}" "$( ((fields[2])) && echo ' --pause' )" "${fields[@]:3}"
    done < <(grep -v '^ *\(#\|$\)' "$list")
  done
}

# make_sequence NAME KIND ARGUMENTS: unless it is there. Others may make it at the same time: the first one stays.
make_sequence() {
  local folder=$sequences/$1 part=$sequences/.$1.$BASHPID.part arguments status=0
  [[ ! -e $folder/rgb.txt ]] || return 0
  read -ra arguments <<<"$3"
  rm -rf -- "$part"
  mkdir -p -- "$sequences"
  if [[ $2 == rendered ]]; then
    "$bin/dmslam-synth" --quiet --out "$part" "${arguments[@]}" >"$part.txt" 2>&1 || status=$?
  else
    "$shared/tools/add_people.py" "$data" "$part" "${arguments[@]}" >"$part.txt" 2>&1 || status=$?
  fi
  if ((status)); then
    say "$1 cannot be made: $(grep -v '^ *$' "$part.txt" | tail -n 1)"
    return 1
  fi
  rm -f -- "$part.txt"
  [[ -e $folder/rgb.txt ]] || mv -T -- "$part" "$folder" 2>/dev/null || true
  rm -rf -- "$part"
}

# one_run NAME KIND ARGUMENTS: a function of its own process; see start_beside.
one_run() {
  local name=$1 part=$out/.$1.part setting options=() status=0
  make_sequence "$@" || return 1
  for setting in ${settings[@]+"${settings[@]}"}; do options+=(--set "$setting"); done
  rm -rf -- "$part" "${out:?}/$name"
  mkdir -p -- "$part"
  "$bin/dmslam-inprocess" --sequence "$sequences/$name" --camera "$sequences/$name/camera.yaml" --profile "$profile" \
    --seed "$seed" --out "$part" ${options[@]+"${options[@]}"} >"$part/log.txt" 2>&1 || status=$?
  finish_run "$part" "$out/$name" "$status" || {
    say "$name: $(head -n 1 "$out/$name/failed.txt")"
    return 1
  }
}

run_all() {
  local lines line name kind arguments number=0 in_a_row=0
  mapfile -t lines < <(plan)
  for line in ${lines[@]+"${lines[@]}"}; do
    number=$((number + 1))
    IFS=$'\t' read -r name kind arguments <<<"$line"
    ! has_summary "$out/$name" || continue
    if wait_beside "$jobs"; then in_a_row=0; else in_a_row=$((in_a_row + 1)); fi
    ((in_a_row < MAX_FAILURES_IN_A_ROW)) || { wait_beside 1 || true; die "$in_a_row runs failed in a row; see $out"; }
    progress_line "[$number/${#lines[@]}] $name"
    start_beside one_run "$name" "$kind" "$arguments"
  done
  wait_beside 1 || true
  progress_end
}

# Runs of other settings do not belong into the same table.
require_same_options() {
  local now="--profile $profile --seed $seed${settings[*]+ --set ${settings[*]}}"
  if [[ -s $out/options.txt && $(<"$out/options.txt") != "$now" ]]; then
    die "$out holds runs of '$(<"$out/options.txt")', not of '$now'; name another --out"
  fi
  printf '%s\n' "$now" >"$out/options.txt"
}

main() {
  parse "$@"
  local programs=(dmslam-report)
  ((run == 0)) || programs+=(dmslam-synth dmslam-inprocess)
  need_programs "${programs[@]}"
  work_in "$out"
  local lines
  lines=$(plan)
  [[ -n $lines ]] || die "no sequence of the $half half is wanted; see --only and --list"
  if ((run)); then
    require_same_options
    run_all
  fi
  awk -F'\t' -v half="$half" -v folder="$sequences" '{ print half "\t" $1 "\t" $2 "\t" folder "/" $1 }' <<<"$lines" >"$out/$half.tsv"
  local named=() other
  for other in ${compare[@]+"${compare[@]}"}; do named+=(--runs "$other"); done
  "$bin/dmslam-report" population --list "$out/$half.tsv" --runs "${out##*/}=$out" ${named[@]+"${named[@]}"} \
    --out "$out/$half" ${details:+--details}
}

main "$@"
