#!/usr/bin/env bash
# Runs everything that the DM-SLAM paper's tables need and writes the tables. See --help.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly root me=reproduce
# shellcheck source-path=SCRIPTDIR source=lib/resumable.sh
source "$root/scripts/lib/resumable.sh"
readonly MAX_FAILURES_IN_A_ROW=3
readonly REPORT_HEADING="# Results beside the DM-SLAM paper's"

tum='' out='' seeds='' data='' render=1 run=1 publish='' runner='' version=''
processes=0
only=()

usage() {
  cat <<EOF
Usage: reproduce.sh --tum DIR --out DIR [--seeds 10] [options]

Runs 'baseline', 'paper' and 'dm' with 3000 features per frame (as the DM-SLAM paper did) and with the defaults on the paper's
four TUM RGB-D sequences, on the kitchen sequences and on rendered stand-ins, each with as many seeds as said, and writes
DIR/report.md, DIR/report.json and DIR/pictures. Stopped at any time, the same command continues. Sequences that are not
there are listed in the report with the address to get them from (scripts/get_tum.sh paper does it). The report shows all
that was run in DIR so far, also with other sequences or seeds. DIR/progress.txt says how far it is. Three runs that fail
one after the other end it, with the report of what there is and exit status 1.

  --tum DIR       folder that holds the TUM RGB-D sequences, or folders of them, by the benchmark's names
                  (rgbd_dataset_freiburg1_xyz) or the short ones (fr1_xyz)
  --out DIR       where runs and report go
  --seeds N       runs of each (default 10)
  --only NAME     only this sequence (may be repeated), as fr3_walking_xyz, kitchen_walk2, synth_walking_rpy
  --data DIR      folder that holds the kitchen sequences (default: \$DMSLAM_DATA, else ../shared/data)
  --no-render     do not render the stand-ins (about ten minutes, once)
  --report-only   write the report of all runs that are there; takes neither --seeds nor --only, but --tum and --data
                  where sequences are no longer in the folders where they were
  --publish FILE  also write the report to this page, with pictures of rendered sequences only
  --processes     run the real processes in lock-step (scripts/run.sh), not dmslam-inprocess; the bytes are the same
  --runner CMD    program to run instead (it gets the arguments of scripts/run.sh)
  --help          this text
EOF
}

parse() {
  while (($#)); do
    case $1 in
      --help | -h) usage; exit 0 ;;
      --no-render) render=0; shift; continue ;;
      --report-only) run=0; shift; continue ;;
      --processes) processes=1; shift; continue ;;
      --tum | --out | --seeds | --only | --data | --publish | --runner) ;;
      *) die "unknown argument $1; see --help" ;;
    esac
    (($# > 1)) || die "$1 needs a value; see --help"
    case $1 in
      --only) only+=("$2") ;;
      *) printf -v "${1#--}" %s "$2" ;;
    esac
    shift 2
  done
  [[ -n $out ]] || die "--out DIR is missing; see --help"
  [[ -n $tum || $run == 0 ]] || die "--tum DIR is missing (an empty folder serves where there are none); see --help"
  [[ -z $tum || -d $tum ]] || die "--tum $tum: no such folder; scripts/get_tum.sh --to $tum paper fills it"
  ((run)) || [[ -z $seeds && ${#only[@]} == 0 ]] ||
    die "--report-only tells of all runs in $out: leave --seeds and --only out, or leave --report-only out to run them"
  ((run)) || [[ -d $out/runs ]] ||
    die "--out $out: holds no runs to report; name the folder of an earlier --out, or leave --report-only out to run them"
  seeds=${seeds:-10}
  [[ $seeds =~ ^[1-9][0-9]{0,3}$ ]] || die "--seeds $seeds: write a number of at least 1"
  [[ -z $publish ]] || check_page
  find_data
}

# dmslam-report refuses these pages too, but only after all runs.
check_page() {
  [[ ${publish##*/} == ?*.md && ! -d $publish ]] || die "--publish $publish: is not the name of a page; write FOLDER/NAME.md"
  local page=${publish##*/} folder
  folder=$(dirname -- "$publish")
  if [[ -e $publish ]]; then
    [[ $(head -n 1 -- "$publish") == "$REPORT_HEADING" ]] || die "--publish $publish: is another page, and would be lost;" \
      "name one that is not there yet, or a report (its first line is '$REPORT_HEADING')"
  elif [[ -e $folder/images/${page%.md} ]]; then
    die "--publish $publish: $folder/images/${page%.md} is there without its page, and would be lost;" \
      "remove it or name another page"
  fi
  until [[ -e $folder ]]; do folder=$(dirname -- "$folder"); done
  [[ -d $folder && -w $folder ]] || die "--publish $publish: $folder is no folder that can be written to; name another"
}

# The kitchen sequences' folder: one that was named must be there, the usual ones need not.
find_data() {
  [[ -z $data || -d $data ]] || die "--data $data: no such folder; name the one that holds kitchen, or leave --data out"
  [[ -z $data && $run == 1 ]] || return 0
  data=${DMSLAM_DATA:-$root/../shared/data}
  [[ -z ${DMSLAM_DATA:-} || -d $data ]] || say "DMSLAM_DATA is $data, which is no folder: without the kitchen sequences"
}

# Sets `bin` to the folder with the programs, built where they are not there.
find_programs() {
  local programs=(dmslam-report)
  ((run == 0 || render == 0)) || programs+=(dmslam-synth)
  [[ $run == 0 || $processes == 1 || -n $runner ]] || programs+=(dmslam-inprocess)
  [[ $run == 0 || -n $runner ]] || programs+=(dmslam-static)
  need_programs "${programs[@]}"
}

wanted() { ((${#only[@]} == 0)) || [[ " ${only[*]} " == *" $1 "* ]]; }

# render NAME ARGUMENTS...: a stand-in, unless it is there.
render() {
  local name=$1
  shift
  wanted "$name" && [[ ! -e $out/synthetic/$name/rgb.txt ]] || return 0
  say "rendering $name"
  note_progress "rendering $name"
  rm -rf -- "$out/synthetic/$name.part"
  start "$bin/dmslam-synth" --out "$out/synthetic/$name.part" --seed 1 "$@" || die "$name cannot be rendered"
  mv -- "$out/synthetic/$name.part" "$out/synthetic/$name"
}

render_stand_ins() {
  mkdir -p -- "$out/synthetic"
  local motion frames
  for motion in xyz:859 rpy:910 halfsphere:1067; do
    frames=${motion#*:} motion=${motion%:*}
    render "synth_walking_$motion" --preset "walking_$motion"
    render "synth_still_$motion" --path "$motion" --frames "$frames"
  done
  render synth_xyz --preset static_xyz --camera "$root/config/TUM1.yaml"
}

# is_current FILE: what stands beside it was made by programs of this version.
is_current() { [[ -s $1 && $(<"$1") == "$version" ]]; }

# draw_selection NAME SEQUENCE CAMERA: the paper's Figures 2 to 5, what plain RANSAC and DLRSAC take for static.
draw_selection() {
  local folder=$out/figures/$1 method picture
  ! is_current "$folder/version" || return 0
  progress_line "figures of $1"
  note_progress "drawing figures of $1"
  rm -rf -- "$folder" "$folder.part"
  for method in dlrsac ransac; do
    start "$bin/dmslam-static" --sequence "$2" --camera "$3" --method "$method" --features 3000 --gap 5 --no-window \
      --pairs 2 --out "$folder.part/$method" >"$out/figures.log" 2>&1 ||
      { progress_end; say "no figures of $1: $(tail -n 1 "$out/figures.log")"; return 0; }
    for picture in "$folder.part/$method"/*.png; do
      mv -- "$picture" "$folder.part/${picture##*/}.$method"
    done
    rm -rf -- "${folder:?}.part/$method"
  done
  # Names that sort by pair, DLRSAC beside RANSAC.
  for picture in "$folder.part"/*; do
    method=${picture##*.}
    picture=${picture%.png.*}
    mv -- "$picture.png.$method" "${picture}_$method.png"
  done
  printf '%s\n' "$version" >"$folder.part/version"
  mv -- "$folder.part" "$folder"
}

# draw_selections LINES...: of every sequence in which somebody walks, once however many runs it has.
draw_selections() {
  local line folder sequence camera name rest
  local -A seen=()
  for line in "$@"; do
    IFS=$'\t' read -r folder sequence _ camera rest <<<"$line"
    name=${folder#runs/}
    name=${name%%/*}
    [[ $name == *walk* && -z ${seen[$name]:-} ]] || continue
    seen[$name]=1
    [[ $camera == /* ]] || camera=$root/$camera
    draw_selection "$name" "$sequence" "$camera"
  done
  progress_end
}

# time_methods LINES...: the paper's Table 1, on the first sequence in which somebody walks.
time_methods() {
  local line folder sequence camera rest
  [[ ! -s $out/table1.json ]] || ! is_current "$out/table1.version" || return 0
  for line in "$@"; do
    IFS=$'\t' read -r folder sequence _ camera rest <<<"$line"
    [[ $folder == *walk* ]] || continue
    [[ $camera == /* ]] || camera=$root/$camera
    time_on "$sequence" "$camera"
    break
  done
  progress_end
}

# time_on SEQUENCE CAMERA
time_on() {
  local table=$out/table1.json
  progress_line "times of the methods"
  note_progress "timing the methods of Table 1"
  rm -f -- "$table" "$table.part" "$out/table1.version"
  if start "$bin/dmslam-static" time --sequence "$1" --camera "$2" --json "$table.part" >"$out/table1.log" 2>&1; then
    printf '%s\n' "$version" >"$out/table1.version"
    mv -- "$table.part" "$table"
  else
    progress_end
    say "no Table 1: $(tail -n 1 "$out/table1.log")"
  fi
}

# Sets `command` to what runs a sequence.
choose_command() {
  if [[ -n $runner ]]; then command=("$runner" --lockstep)
  elif ((processes)); then command=("$root/scripts/run.sh" --lockstep)
  else command=("$bin/dmslam-inprocess"); fi
}

duration() {
  local s=$1
  if ((s < 90)); then printf '%d s' "$s"
  elif ((s < 5400)); then printf '%d min' $(((s + 30) / 60))
  else printf '%d h %02d min' $((s / 3600)) $((s % 3600 / 60)); fi
}

# How long the rest takes, by the frames done so far; nothing where none is done yet.
time_left() { ((frames_done == 0)) || duration $(((SECONDS - began) * frames_left / frames_done)); }

# On a terminal only: which run this is and how long the rest takes.
progress() {
  [[ -t 2 ]] || return 0
  local left
  left=$(time_left)
  printf '\r\033[K[%d/%d] %s%s' "$number" "$total" "$1" "${left:+, $left left}" >&2
}

# note_progress WHAT: DIR/progress.txt, the same for who looks from elsewhere. It is never there in halves.
runs_done=0 total='' runs_failed=0 last_run='' frames_done=0 frames_left=0 began=0 todo=()
note_progress() {
  local left
  left=$(time_left)
  {
    printf 'at: %s\n' "$(date '+%F %T')"
    printf 'now: %s\n' "$1"
    printf 'runs done: %s\n' "$runs_done of ${total:-all (not counted yet)}"
    printf 'failed this time: %d\n' "$runs_failed"
    printf 'time left: %s\n' "${left:-not known yet}"
    printf 'last run: %s\n' "${last_run:-none yet}"
  } >"$out/progress.txt.part"
  mv -- "$out/progress.txt.part" "$out/progress.txt"
}

# one_run FOLDER SEQUENCE FRAMES CAMERA PROFILE SEED SET. The first seed leaves a few pictures.
one_run() {
  local folder=$out/$1 part=$out/$1.part log=$out/$1.log status=0
  local arguments=(--sequence "$2" --camera "$4" --out "$part" --profile "$5" --seed "$6")
  [[ $7 == - ]] || arguments+=(--set "$7")
  [[ $6 != 1 ]] || arguments+=(--pictures $(($3 / 4 + 1)))
  rm -rf -- "$part" "$folder"
  mkdir -p -- "$(dirname "$folder")"
  start "${command[@]}" "${arguments[@]}" >"$log" 2>&1 || status=$?
  mkdir -p -- "$part"
  mv -- "$log" "$part/log.txt"
  finish_run "$part" "$folder" "$status"
}

# count_runs LINES...: sets `todo` to those that are not done yet, and the numbers of the progress. What failed the last
# time comes last, so that it keeps nothing else from being run.
count_runs() {
  local line folder frames rest failed=()
  total=$# todo=() began=$SECONDS
  for line in "$@"; do
    IFS=$'\t' read -r folder _ frames rest <<<"$line"
    if [[ $rest == *$'\t'done ]]; then
      runs_done=$((runs_done + 1))
      continue
    fi
    if [[ -e $out/$folder/failed.txt ]]; then failed+=("$line"); else todo+=("$line"); fi
    frames_left=$((frames_left + frames))
  done
  todo+=(${failed[@]+"${failed[@]}"})
}

# account_for NAME STATUS FOLDER: says what failed.
failed_in_a_row=0
account_for() {
  last_run="$1, done at $(date '+%F %T')"
  if (($2 == 0)); then
    runs_done=$((runs_done + 1)) failed_in_a_row=0
    return
  fi
  progress_end
  last_run="$1, failed at $(date '+%F %T'): $(head -n 1 "$3/failed.txt")"
  say "runs/$1: $(head -n 1 "$3/failed.txt")"
  runs_failed=$((runs_failed + 1)) failed_in_a_row=$((failed_in_a_row + 1))
  too_many_failed || return 0
  say "$failed_in_a_row runs failed in a row; see $3/log.txt. The others are left out; the same command begins with them"
}
too_many_failed() { ((failed_in_a_row >= MAX_FAILURES_IN_A_ROW)); }

# What `todo` holds, until too much of it fails.
run_all() {
  local line folder sequence frames camera profile seed set status number=$runs_done
  began=$SECONDS
  for line in ${todo[@]+"${todo[@]}"}; do
    IFS=$'\t' read -r folder sequence frames camera profile seed set _ <<<"$line"
    number=$((number + 1)) status=0
    progress "${folder#runs/}"
    note_progress "running ${folder#runs/}"
    [[ $camera == /* ]] || camera=$root/$camera
    one_run "$folder" "$sequence" "$frames" "$camera" "$profile" "$seed" "$set" || status=$?
    frames_done=$((frames_done + frames)) frames_left=$((frames_left - frames))
    account_for "${folder#runs/}" "$status" "$out/$folder"
    ! too_many_failed || break
  done
  progress_end
}

# How it ended, for who reads DIR/progress.txt.
note_end() {
  case $1 in
    0) note_progress "finished" ;;
    130) note_progress "stopped; the same command continues" ;;
    *)
      if [[ -n $total ]]; then note_progress "ended with exit status $1; the same command continues"
      else note_progress "ended with exit status $1 before the first run; the command has said why"; fi
      ;;
  esac
}

run_everything() {
  trap 'note_end $?' EXIT
  version=$("$bin/dmslam-report" --version)
  ((render == 0)) || render_stand_ins
  local roots=(--root "$tum") plan lines=()
  [[ ! -d $data ]] || roots+=(--root "$data")
  [[ ! -d $out/synthetic ]] || roots+=(--root "$out/synthetic")
  plan=$("$bin/dmslam-report" plan "${roots[@]}" --out "$out" --seeds "$seeds" ${only[@]+--only "${only[@]}"})
  [[ -z $plan ]] || mapfile -t lines <<<"$plan"
  ((${#lines[@]})) || say "none of the sequences is there: the report will only list them"
  count_runs ${lines[@]+"${lines[@]}"}
  [[ -n $runner ]] || { draw_selections ${lines[@]+"${lines[@]}"}; time_methods ${lines[@]+"${lines[@]}"}; }
  run_all
}

main() {
  parse "$@"
  find_programs
  work_in "$out"
  choose_command
  local roots=()
  if ((run)); then run_everything; else roots=(${tum:+--root "$tum"} ${data:+--root "$data"}); fi
  "$bin/dmslam-report" write --out "$out" ${roots[@]+"${roots[@]}"} ${publish:+--publish "$publish"}
  ! too_many_failed
}

main "$@"
