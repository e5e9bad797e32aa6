#!/usr/bin/env bash
# Moving people from none to 80 % of the image, 'dm' against 'baseline', and each switch off alone. See --help.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root me=sweep
# shellcheck source-path=SCRIPTDIR source=lib/resumable.sh
source "$root/scripts/lib/resumable.sh"
readonly SHARES=(0 10 20 30 40 50 60 70 80) KINDS=(walk stop-and-go) MAX_FAILURES_IN_A_ROW=5
# The ablation's variants, and what each gives dmslam-inprocess.
readonly VARIANTS=(dm no_exclusion no_belief no_seen_through arsac ransac baseline)
declare -rA SWITCHES=([dm]="" [no_exclusion]="--set mapping.mutual_exclusion=off"
  [no_belief]="--set tracking.motion_belief=off" [no_seen_through]="--set mapping.seen_through=off"
  [arsac]="--set initializer.method=arsac" [ransac]="--set initializer.method=ransac" [baseline]="--profile baseline")

out=$root/out/sweep seeds=5 frames=250 data=${DMSLAM_DATA:-$root/../shared/data} run=1 publish='' parts=(sweep ablation)

usage() {
  cat <<END
Usage: sweep.sh [--out DIR] [--seeds 5] [options]

Sweep: renders people who walk, and people who walk and stop, over 0, 10, ..., 80 % of the image, and runs 'dm' and then
'baseline' on each, every seed once. Ablation: runs kitchen_walk1 and kitchen_walk2 with each switch off alone, and counts
how many landmarks of the final map are seen on walkers. Everything runs in one process, in lock-step. Writes
DIR/dynamic-scenes.md and the sweep's picture. Stopped at any time, the same command continues.

  --out DIR       default: out/sweep in the project; some 800 MB
  --seeds N       runs of each (default 5)
  --frames N      length of the rendered sequences (default 250)
  --only PART     only 'sweep' or only 'ablation'
  --data DIR      folder that holds the kitchen sequences (default: \$DMSLAM_DATA, else ../shared/data)
  --report-only   write tables and picture from the runs that are there
  --publish FILE  also put them between this page's marks, its picture into the folder images beside it
  --help          this text
END
}

parse() {
  while (($#)); do
    case $1 in
      --help | -h) usage; exit 0 ;;
      --report-only) run=0; shift; continue ;;
      --out | --seeds | --frames | --only | --data | --publish) ;;
      *) die "unknown argument $1; see --help" ;;
    esac
    (($# > 1)) || die "$1 needs a value; see --help"
    case $1 in
      --only) parts=("$2") ;;
      *) printf -v "${1#--}" %s "$2" ;;
    esac
    shift 2
  done
  [[ $seeds =~ ^[1-9][0-9]{0,2}$ ]] || die "--seeds $seeds: write a number from 1 on"
  [[ $frames =~ ^[1-9][0-9]{1,4}$ ]] || die "--frames $frames: write a number from 10 on"
  [[ " sweep ablation " == *" ${parts[0]} "* ]] || die "--only ${parts[0]}: choose sweep or ablation"
}

# Sets `bin` to the folder with the programs, built where they are not there.
find_programs() {
  local programs=(dmslam-report)
  ((run == 0)) || programs+=(dmslam-synth dmslam-inprocess dmslam-map)
  need_programs "${programs[@]}"
}

# On a terminal only: what is in work, and how long the rest takes, by the work done since we began.
work_done=0 began=$SECONDS
progress() { # DONE TOTAL WHAT
  [[ -t 2 ]] || return 0
  local left=''
  ((work_done == 0)) || left=", $(((SECONDS - began) * ($2 - $1) / work_done / 60 + 1)) min left"
  printf '\r\033[K[%d/%d] %s%s' "$(($1 + 1))" "$2" "$3" "$left" >&2
}

sequence_name() { ((10#$2 == 0)) && echo synth_0 || echo "synth_$1_$2"; } # nobody there: the same for both kinds

# render KIND SHARE: a sequence, unless it is there. All show the same room from the same path.
render() {
  local name folder people=()
  name=$(sequence_name "$1" "$2")
  folder=$out/sequences/$name
  [[ ! -e $folder/rgb.txt ]] || return 0
  mkdir -p -- "$out/sequences"
  (($2 == 0)) || people=(--moving-share "$(printf '0.%02d' "$2")" --behaviour "$1")
  rm -rf -- "$folder.part"
  start "$bin/dmslam-synth" --quiet --gray --frames "$frames" --seed 1 "${people[@]}" --out "$folder.part" ||
    die "$name cannot be rendered"
  mv -- "$folder.part" "$folder"
}
# One line per run: folder under DIR/runs, sequence's folder, camera, options, and what is to be rendered for it. Seed by
# seed: stopped early, all have equally many.
plan_sweep() {
  local profile share kind seed name
  for ((seed = 1; seed <= seeds; ++seed)); do
    for profile in dm baseline; do
      for share in "${SHARES[@]}"; do
        for kind in "${KINDS[@]}"; do
          [[ $share != 0 || $kind == walk ]] || continue
          name=$(sequence_name "$kind" "$share")
          printf '%s\t%s\t%s\t%s\t%s\n' "$name/sweep/$profile/seed_$seed" "$out/sequences/$name" \
            "$out/sequences/$name/camera.yaml" "--profile $profile --seed $seed" "$kind $share"
        done
      done
    done
  done
}
plan_ablation() {
  local variant seed name profile
  for ((seed = 1; seed <= seeds; ++seed)); do
    for variant in "${VARIANTS[@]}"; do
      profile=dm
      [[ $variant != baseline ]] || profile=baseline
      for name in kitchen_walk1 kitchen_walk2; do
        [[ -d $data/$name ]] || continue
        printf '%s\t%s\t%s\t%s\t\n' "$name/$variant/$profile/seed_$seed" "$data/$name" "$root/config/kitchen.yaml" \
          "${SWITCHES[$variant]} --seed $seed --save-map map.log"
      done
    done
  done
}

# one_run FOLDER SEQUENCE CAMERA OPTIONS
one_run() {
  local folder=$out/runs/$1 part=$out/runs/$1.part options status=0
  read -ra options <<<"${4//map.log/$part/map.log}"
  rm -rf -- "$part" "$folder"
  mkdir -p -- "$part"
  start "$bin/dmslam-inprocess" --sequence "$2" --camera "$3" --out "$part" "${options[@]}" >"$part/log.txt" 2>&1 || status=$?
  if [[ -s $part/map.log ]]; then
    start "$bin/dmslam-map" --log "$part/map.log" --masks "$2" --json "$part/map.json" >>"$part/log.txt" 2>&1 || true
    rm -f -- "$part/map.log"
  fi
  finish_run "$part" "$folder" "$status"
}
run_all() { # PART
  local lines=() line folder sequence camera options rendered number=0 in_a_row=0
  mapfile -t lines < <("plan_$1")
  work_done=0 began=$SECONDS
  for line in ${lines[@]+"${lines[@]}"}; do
    IFS=$'\t' read -r folder sequence camera options rendered <<<"$line"
    if ! has_summary "$out/runs/$folder"; then
      progress "$number" "${#lines[@]}" "$folder"
      # shellcheck disable=SC2086 # two words
      [[ -z $rendered ]] || render $rendered
      if one_run "$folder" "$sequence" "$camera" "$options"; then
        in_a_row=0
      else
        progress_end
        say "$folder: $(head -n 1 "$out/runs/$folder/failed.txt")"
        in_a_row=$((in_a_row + 1))
        ((in_a_row < MAX_FAILURES_IN_A_ROW)) || die "$in_a_row runs failed in a row; see $out/runs/$folder/log.txt"
      fi
      work_done=$((work_done + 1))
    fi
    number=$((number + 1))
  done
  progress_end
}

main() {
  parse "$@"
  find_programs
  work_in "$out"
  if ((run)); then
    local part
    for part in "${parts[@]}"; do
      if [[ $part == ablation && ! -d $data/kitchen_walk1 ]]; then
        say "$data/kitchen_walk1 is not there: no ablation; set --data or DMSLAM_DATA"
      fi
      run_all "$part"
    done
  fi
  "$bin/dmslam-report" sweep --out "$out" --seeds "$seeds" --data "$data" ${publish:+--publish "$publish"}
}

main "$@"
