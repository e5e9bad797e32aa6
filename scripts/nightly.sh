#!/usr/bin/env bash
# The long bars. Stopped at any time, the same command continues. See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly SCHEDULES=10000 SCHEDULES_PER_STEP=1000 SYSTEM_SCHEDULES=2000 SYSTEM_SCHEDULES_PER_STEP=500 SEEDS=5
out=$top/out/nightly data=${DMSLAM_DATA:-$top/../shared/data} fuzz_seconds=60
only=""
usage() {
  cat <<EOF
Usage: scripts/nightly.sh [--out DIR] [--data DIR] [--only PATTERN] [--fuzz-seconds N] [--list]

Runs what takes too long for every commit, each step once, and writes DIR/table.md with what was reached and what is asked:
all tests; kitchen seeds 1..$SEEDS in lock-step, the same seed twice, kitchen in real time; kitchen_walk1 and kitchen_walk2;
localisation in a saved map; recording and replay; $SCHEDULES seeded schedules of the stream protocol and $SYSTEM_SCHEDULES of the whole system; 5,000 keyframes and 300,000 landmarks in the viewer; benchmarks, their
ratios to cv::ORB and a map that grows to 5,000 keyframes; a run under
AddressSanitizer and UBSan; fuzzing of every reader of bytes.
A step that is done (DIR/<step>/done) is not done again; remove DIR to begin anew.

  --out DIR           default: out/nightly in the project
  --data DIR          the kitchen sequences (default: \$DMSLAM_DATA, else ../shared/data); without them those steps are skipped
  --only PATTERN      only the steps whose name matches, as 'kitchen*'
  --fuzz-seconds N    per target (default 60)
  --soak              also the sequence forwards and backwards for an hour
  --list              names the steps
EOF
}
say() { echo "nightly: $*" >&2; }
die() { say "$*"; exit 1; }
list=0 soak=0
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --list) list=1; shift ;;
    --soak) soak=1; shift ;;
    --out | --data | --only | --fuzz-seconds)
      (($# > 1)) || die "$1 needs a value; see --help"
      name=${1#--}
      printf -v "${name//-/_}" %s "$2"
      shift 2
      ;;
    *) die "unknown option $1; see --help" ;;
  esac
done

# Runs in the step's own folder; what it returns decides. Everything a step says goes into its log.
step_tests() { DMSLAM_FORGED_TIMES="1 5" "$top/scripts/test.sh"; }
kitchen_run() { # FOLDER SEQUENCE MODE SEED
  local mode=()
  [[ $3 == realtime ]] || mode=(--lockstep)
  "$top/scripts/run.sh" --sequence "$data/$2" --camera "$top/config/kitchen.yaml" "${mode[@]}" --seed "$4" --out "$1"
}
step_kitchen() { kitchen_run "$1" kitchen lockstep "$2"; }
step_walk1() { kitchen_run "$1" kitchen_walk1 lockstep "$2"; }
step_walk2() { kitchen_run "$1" kitchen_walk2 lockstep "$2"; }
step_realtime() { kitchen_run "$1" kitchen realtime 1; }
step_again() { # the first seed once more: the same bytes
  kitchen_run "$1" kitchen lockstep 1
  cmp "$1/trajectory.txt" "$out/kitchen_1/trajectory.txt"
}
step_notexture() { # a sound trajectory, or the reason why there is none; never a crash
  local code=0
  "$top/scripts/run.sh" --sequence "$data/rgbd_dataset_freiburg3_structure_notexture_far" --lockstep --out "$1" || code=$?
  ((code < 64))
}
step_schedules() { # FOLDER FIRST
  DMSLAM_FIRST_SCHEDULE=$2 DMSLAM_SCHEDULES=$SCHEDULES_PER_STEP "$top/build/release/bin/simulation_test" \
    --gtest_filter=Simulation.EverySchedulesPromisesAreKept
}
step_system() { # FOLDER FIRST: all processes on a simulated network
  DMSLAM_SOURCE_DIR=$top DMSLAM_FIRST_SCHEDULE=$2 DMSLAM_SCHEDULES=$SYSTEM_SCHEDULES_PER_STEP \
    "$top/build/release/bin/system_simulation_test" --gtest_filter=SystemSimulation.EverySchedulesPromisesAreKept
}
step_sanitizers() {
  "$top/scripts/build.sh" asan-ubsan dmslam-inprocess dmslam-synth
  local bin=$top/build/asan-ubsan/bin
  "$top/build/release/bin/dmslam-synth" --quiet --frames 90 --moving-share 0.15 --seed 1 --out "$1/sequence"
  "$bin/dmslam-inprocess" --sequence "$1/sequence" --camera "$top/config/synthetic.yaml" --out "$1"
}
step_viewer() { # a large map in a browser without a graphics processor
  /usr/bin/python3 "$top/tests/system/viewer_load.py" --bin "$top/build/release/bin" --picture "$1/viewer.png"
}
step_bench() { "$top/scripts/bench.sh" --counts --tour --out "$1"; }
step_localize() { "$top/scripts/localize.sh" --out "$1" --data "$data"; }
step_sessions() { "$top/scripts/sessions.sh" --out "$1" --data "$data"; }
step_replay() { "$top/scripts/replay.sh" --out "$1" --data "$data"; }
step_kills() { # FOLDER SEQUENCE: processes die, and the run goes on
  local tracked=90
  [[ $2 == kitchen ]] || tracked=85
  "$top/scripts/kill_test.sh" --sequence "$data/$2" --camera "$top/config/kitchen.yaml" --min-tracked "$tracked" --out "$1"
}
step_killsets() { # every two and three of the five at once, and all of them
  "$top/scripts/kill_test.sh" --sequence "$data/kitchen" --camera "$top/config/kitchen.yaml" --victims pairs,triples,all --out "$1"
}
step_killstorm() { # 200 deaths in ten minutes
  "$top/scripts/kill_storm.sh" --sequence "$data/kitchen" --camera "$top/config/kitchen.yaml" --out "$1"
}
step_forgeries() { # by who has no key, with a key and without
  "$top/scripts/forgeries.sh" --out "$1"
}
step_keycost() { "$top/scripts/key_cost.sh" --sequence "$data/kitchen_walk1" --camera "$top/config/kitchen.yaml" --out "$1"; }
step_twohosts() { # a link that drops 0, 5 and 20 % of the packets, and a mapper that moves to the other host
  local play=("$top/scripts/two_hosts.sh" --sequence "$data/kitchen" --camera "$top/config/kitchen.yaml")
  "${play[@]}" --out "$1/drops" && "${play[@]}" --lockstep --drop 5 --move-mapper 15 --out "$1/moved"
}
step_noise() { # 10^6 hostile messages, 20,000 a second
  local port=$((20000 + RANDOM % 30000)) noise status=0
  "$top/build/release/bin/dmslam-noise" --lcm-url "udpm://239.255.76.67:$port?ttl=0" --count 1000000 --rate 20000 &
  noise=$!
  "$top/scripts/run.sh" --share-port --port "$port" --sequence "$data/kitchen" --camera "$top/config/kitchen.yaml" --lockstep \
    --seed 1 --out "$1" || status=$?
  kill -TERM "$noise" 2>/dev/null || true
  ((status == 0)) && cmp "$1/trajectory.txt" "$out/kitchen_1/trajectory.txt"
}
step_mutations() { "$top/scripts/fuzz.sh" --mutations 10000000 messages; }
step_soak() { "$top/scripts/soak.sh" --sequence "$data/kitchen" --camera "$top/config/kitchen.yaml" --out "$1"; }
step_loops() { # keeps what was played beside the step's folder, so that it continues where it was stopped
  "$top/scripts/loops.sh" --out "$out/loops_played" --seeds "$SEEDS"
  ! grep -qE 'missed|not tracked|/ [1-9]' "$out/loops_played/table.md"
}
step_welds() { # keeps what was played, as loops; a run that is not good fails it
  "$top/scripts/welds.sh" --out "$out/welds_played" --seeds 3
}
step_lost() {
  "$top/scripts/lost.sh" --out "$1" --data "$data"
  ! grep -q missed "$1/table.md"
}
step_fuzz() { "$top/scripts/fuzz.sh" --seconds "$fuzz_seconds"; }

steps=("tests")
for ((seed = 1; seed <= SEEDS; ++seed)); do steps+=("kitchen_$seed $seed"); done
steps+=("again" "realtime" "notexture")
for name in walk1 walk2; do
  for ((seed = 1; seed <= SEEDS; ++seed)); do steps+=("${name}_$seed $seed"); done
done
for ((first = 1; first <= SCHEDULES; first += SCHEDULES_PER_STEP)); do steps+=("schedules_$first $first"); done
for ((first = 1; first <= SYSTEM_SCHEDULES; first += SYSTEM_SCHEDULES_PER_STEP)); do steps+=("system_$first $first"); done
steps+=("lost" "loops" "welds")
steps+=("kills_kitchen kitchen" "kills_walk1 kitchen_walk1" "killsets" "killstorm" "noise" "forgeries" "keycost" "localize" "sessions" "replay" "viewer" "bench" "sanitizers" "fuzz" "mutations")
((EUID != 0)) || steps+=("twohosts") # it makes network namespaces
((soak == 0)) || steps+=("soak")
if ((list)); then printf '%s\n' "${steps[@]%% *}"; exit 0; fi

needs_data() { [[ $1 =~ ^(kitchen|again|realtime|walk|notexture|bench|localize|sessions|replay|kills|noise|keycost|twohosts|soak|lost) ]]; }
run_step() { # NAME [ARGUMENT]
  local folder=$out/$1 status=0
  [[ ! -e $folder/done ]] || return 0
  rm -rf -- "$folder"
  mkdir -p -- "$folder"
  say "$1"
  local began=$SECONDS
  set -m # a group of its own: an interrupt reaches it through us
  ("step_${1%%_*}" "$folder" "${2:-}") >"$folder/log.txt" 2>&1 </dev/null &
  child=$!
  set +m
  wait "$child" || status=$?
  child=""
  echo "$status $((SECONDS - began))" >"$folder/done"
  ((status == 0)) || say "$1 failed (code $status); see $folder/log.txt"
}

value() { sed -nE "s/^ *\"$2\": *([^,]*),?$/\1/p" "$out/$1/summary.json" 2>/dev/null | head -n 1; }
write_table() {
  local name status seconds
  {
    echo "| step | result | seconds | tracked online / in the end [%] | ATE final / online [m] | skipped | frontend median / p95 [ms] |"
    echo "|---|---|---|---|---|---|---|"
    for name in "${steps[@]%% *}"; do
      [[ -e $out/$name/done ]] || continue
      read -r status seconds <"$out/$name/done"
      [[ $status == 0 ]] && status=passed || status="failed ($status)"
      if [[ -s $out/$name/summary.json ]]; then
        printf '| %s | %s | %s | %.1f / %.1f | %s / %s | %s | %.1f / %.1f |\n' "$name" "$status" "$seconds" \
          "$(value "$name" tracked_online_percent)" "$(value "$name" tracked_percent)" \
          "$(value "$name" ate_rmse_final | cut -c1-7)" "$(value "$name" ate_rmse_online | cut -c1-7)" \
          "$(value "$name" frames_skipped)" "$(value "$name" frontend_ms_median)" "$(value "$name" frontend_ms_p95)"
      else
        echo "| $name | $status | $seconds | | | | |"
      fi
    done
    echo
    echo "Bars: kitchen_1..$SEEDS tracked online >= 96, in the end >= 97, median ATE final <= 0.008, none above 0.012;"
    echo "again: the same bytes as kitchen_1; realtime: nothing skipped, ATE at most 15 % above the median of lock-step;"
    echo "localize: kitchen_walk1 >= 95 %, kitchen_walk2 >= 90 % of frames found, median <= 0.3 %, 95th percentile <= 1 % of the"
    echo "path's extent; sessions: joint ATE <= 0.010 m; replay: tracked within 2 points, ATE within 0.010 m. They say in their log.txt"
    echo "what they measured."
  } >"$out/table.md"
}

child=""
trap '[[ -z $child ]] || kill -TERM -- "-$child" 2>/dev/null; wait 2>/dev/null; rm -f "$out/.lock"; say "stopped; the same command continues"; exit 130' INT TERM
mkdir -p -- "$out" || die "$out cannot be made"
out=$(cd "$out" && pwd)
exec 9>"$out/.lock"
flock -n 9 || die "another nightly.sh is working in $out"
"$top/scripts/setup.sh" test
"$top/scripts/build.sh" --tests release
[[ -d $data/kitchen ]] || say "$data/kitchen is not there: the steps that need it are skipped; set --data or DMSLAM_DATA"
for step in "${steps[@]}"; do
  read -r name argument <<<"$step"
  # shellcheck disable=SC2053
  [[ -z $only || $name == $only ]] || continue
  if needs_data "$name" && [[ ! -d $data/kitchen ]]; then continue; fi
  run_step "$name" "$argument"
  write_table
done
write_table
cat "$out/table.md"
! grep -qs -v '^0 ' "$out"/*/done
