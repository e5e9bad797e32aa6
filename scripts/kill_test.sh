#!/usr/bin/env bash
# Kills processes of a run, and measures what it cost. See --help.
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
usage() {
  cat <<'EOF'
Usage: scripts/kill_test.sh --sequence DIR --out DIR [options]

Plays a sequence in lock-step without disturbance, and then once per victim while the victim is ended by SIGKILL at seeded
random frames; scripts/run.sh starts it again each time. Each run must end with 0 and with all frames, hold every keyframe that
was proposed (or have culled it), lose no record, track online as much as is asked for, and have at most 1.5 times the undisturbed
error, online and in the end. No keyframe may be lost with its frontend, but one for each strike that met frontend and
collector; none in a crash; and no pose: each frame that the undisturbed run placed online is placed online, but three for each
frontend that was killed, and in the end. In 'all', where the map since the last checkpoint is gone, such keyframes and poses may
be lost, and the final error is held to 1.5 times the undisturbed one online.
Writes DIR/table.md; runs that are there already are not repeated.

  --camera FILE      camera file (YAML)
  --victims LIST     of frontend, mapper, loopcloser, player, collector, double (two at once, three times), pairs and triples
                     (all ten sets of two, and of three, of these five; the next strike waits until who died has the map
                     again, so that somebody always holds it), all (the five at once, twice: the map comes from the
                     collector's checkpoint) and first (one kill before the first map), with commas; default:
                     frontend,mapper,loopcloser,double,first
  --kills N          per run (default 5)
  --frames N         at most so many frames
  --set KEY=VALUE    one setting of all runs; may be repeated
  --min-tracked P    least share tracked online [%] (default 90)
  --seed N           of the moments (default 1)
  --build-dir DIR    where the programs are (default: build/release)
EOF
}
fail() { echo "kill_test.sh: $*" >&2; exit 1; }

sequence="" out="" victims=frontend,mapper,loopcloser,double,first kills=5 min_tracked=90 seed=1
build=$top/build/release arguments=()
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --sequence | --out | --victims | --kills | --min-tracked | --seed | --build-dir)
      (($# > 1)) || fail "$1 needs a value (see --help)"
      name=${1#--}
      [[ $name != build-dir ]] || name=build
      printf -v "${name//-/_}" %s "$2"
      shift 2
      ;;
    --camera | --frames | --set) arguments+=("$1" "$2"); shift 2 ;;
    *) fail "unknown option $1 (see --help)" ;;
  esac
done
[[ -n $sequence && -n $out ]] || fail "--sequence and --out are needed (see --help)"
mkdir -p "$out"

play() { # FOLDER PORT: a run; its processes can be found by the port
  "$top/scripts/run.sh" --build-dir "$build" --port "$2" --sequence "$sequence" "${arguments[@]}" --lockstep --seed 1 \
    --out "$1" --save-map "$1.map"
}
value() { sed -nE "s/^ *\"$2\": *([^,]*),?$/\1/p" "$out/$1/summary.json" 2>/dev/null | head -n 1; }
free_port() {
  local port
  while :; do
    port=$((20000 + RANDOM % 30000))
    grep -qi ":$(printf '%04X' "$port") " /proc/net/udp || break
  done
  echo "$port"
}
frame_of() { # FOLDER: the newest frame that its collector has told of; -1 before the first map
  local frame
  frame=$(sed -nE 's/.*frame ([0-9]+) of .*/\1/p' "$1/log/collector.log" 2>/dev/null | tail -n 1)
  echo "${frame:--1}"
}
pid_of() { # PROCESS PORT
  local dir line
  for dir in /proc/[0-9]*; do
    line=$({ tr '\0' ' ' <"$dir/cmdline"; } 2>/dev/null) || continue
    [[ $line == *bin/dmslam-$1\ * && $line == *:$2\?* && $line != *setpriv* ]] && echo "${dir#/proc/}"
  done
  return 0
}
strike() { # PORT PROCESS...: at once
  local port=$1 process pids=()
  shift
  for process in "$@"; do mapfile -t -O "${#pids[@]}" pids < <(pid_of "$process" "$port"); done
  ((${#pids[@]} == 0)) || kill -KILL "${pids[@]}" 2>/dev/null || true
  printf 'killed %s\n' "$*"
}
random() { awk -v seed="$1" -v low="$2" -v high="$3" 'BEGIN { srand(seed); for (i = 0; i < 7; ++i) x = rand(); printf "%d", low + x * (high - low) }'; }

# sets NAME: who is killed at once, a line for each strike.
sets() {
  local all=(frontend mapper loopcloser player collector) i j k
  case $1 in
    double) printf '%s\n' 'frontend mapper' 'mapper loopcloser' 'frontend loopcloser' ;;
    pairs) for ((i = 0; i < 5; ++i)); do for ((j = i + 1; j < 5; ++j)); do echo "${all[i]} ${all[j]}"; done; done ;;
    triples)
      for ((i = 0; i < 5; ++i)); do
        for ((j = i + 1; j < 5; ++j)); do for ((k = j + 1; k < 5; ++k)); do echo "${all[i]} ${all[j]} ${all[k]}"; done; done
      done
      ;;
    all) printf '%s\n' "${all[*]}" "${all[*]}" ;;
    first) echo mapper ;;
    *) for ((i = 0; i < kills; ++i)); do echo "$1"; done ;;
  esac
}

told() { grep -c ' keyframes$' "$1/log/collector.log" 2>/dev/null || true; } # FOLDER: how often its collector told of a map
# settled FOLDER RUNNER: who was killed has the map again. What two strikes leave together may be nobody who holds it.
settled() {
  local before
  before=$(told "$1")
  sleep 5
  while kill -0 "$2" 2>/dev/null && (($(told "$1") <= before)); do sleep 0.05; done
}

# disturbed NAME FIRST LAST: kills at random frames after FIRST.
disturbed() {
  local name=$1 first=$2 last=$3 port runner i at count whom
  mapfile -t whom < <(sets "$name")
  count=${#whom[@]}
  port=$(free_port)
  play "$out/$name" "$port" >"$out/$name.said" 2>&1 &
  runner=$!
  for ((i = 0; i < count; ++i)); do
    at=$((first + (last - first) * i / count))
    at=$(random $((seed * 1000 + i * 17 + ${#name})) "$at" $((first + (last - first) * (i + 1) / count)))
    [[ $name != first ]] || at=-2
    while kill -0 "$runner" 2>/dev/null && (($(frame_of "$out/$name") < at)); do sleep 0.05; done
    if [[ $name == first ]]; then sleep 1; else sleep "0.$(random $((seed + i)) 0 9)"; fi
    # shellcheck disable=SC2086
    strike "$port" ${whom[i]} >>"$out/$name.kills"
    [[ $name != pairs && $name != triples ]] || settled "$out/$name" "$runner"
  done
  local status=0
  wait "$runner" || status=$?
  echo "$status" >"$out/$name.status"
}

# As dmslam-run counts them: who dies before its first word is known to nobody else.
restarts() { grep -c 'started again' "$out/$1.said" || true; }

stamps() { cut -d' ' -f1 "$out/$1" | grep -v '#' | sort; }
lacks() { comm -23 <(stamps "$1") <(stamps "$2") | wc -l; }         # how many stamps of one trajectory another one has not
strikes() { grep -c "$1" "$out/$2.kills" 2>/dev/null || true; } # PATTERN NAME

# lost NAME: keyframes and poses that this set does not explain.
lost() {
  local name=$1 wrong="" key allowed
  [[ $(value "$name" keyframes_missing) == 0 ]] || wrong+="keyframes missing; "
  [[ $name != all ]] || { echo "$wrong"; return; }
  [[ $(value "$name" keyframes_lost_in_crash) == 0 ]] || wrong+="keyframes lost in a crash; "
  allowed=$(strikes 'frontend.*collector' "$name")
  key=$(value "$name" keyframes_lost_with_frontend)
  ((${key:-1000} <= allowed + 0)) || wrong+="keyframes lost with a frontend; "
  allowed=$(strikes frontend "$name")
  (($(lacks undisturbed/trajectory_online.txt "$name/trajectory_online.txt") <= 3 * (allowed + 0))) || wrong+="poses lost; "
  (($(lacks "$name/trajectory_online.txt" "$name/trajectory.txt") == 0)) || wrong+="poses lost in the end; "
  echo "$wrong"
}

verdict() { # NAME: what is wrong with its run
  local name=$1 wrong="" error bound
  [[ -s $out/$name/summary.json ]] || { echo "no results"; return; }
  [[ $name == undisturbed || $(<"$out/$name.status") == 0 ]] || wrong+="it ended with $(<"$out/$name.status"); "
  [[ $(value "$name" records_lost) == 0 ]] || wrong+="records lost; "
  [[ $(value "$name" frames) == "$frames" ]] || wrong+="frames are not there; "
  wrong+=$(lost "$name")
  awk "BEGIN { exit !($(value "$name" tracked_online_percent) >= $min_tracked) }" || wrong+="tracked too little; "
  for error in online final; do
    bound=$error
    [[ $name != all ]] || bound=online
    awk -v error="$(value "$name" "ate_rmse_$error")" -v undisturbed="$(value undisturbed "ate_rmse_$bound")" \
      'BEGIN { exit !(error > 0 && error <= 1.5 * undisturbed) }' || wrong+="$error error too large; "
  done
  [[ $name == undisturbed || $(restarts "$name") -ge 1 ]] || wrong+="nobody was restarted; "
  [[ $name == undisturbed || $name == collector || $name == first || $(value "$name" restarts) -ge 1 ]] ||
    wrong+="the results count no restart; "
  "$build/bin/dmslam-map" list "$out/$name.map" >/dev/null 2>&1 || wrong+="its map was not saved; "
  [[ -z $(cut -d' ' -f1 "$out/$name/keyframes.txt" | grep -v '#' | sort | uniq -d) ]] || wrong+="a keyframe twice; "
  echo "$wrong"
}

[[ -s $out/undisturbed/summary.json ]] || play "$out/undisturbed" "$(free_port)" >"$out/undisturbed.said" 2>&1 ||
  fail "the undisturbed run failed; see $out/undisturbed.said"
frames=$(value undisturbed frames)
failed=0
for name in ${victims//,/ }; do
  if [[ ! -s $out/$name.status ]]; then
    rm -rf "${out:?}/$name" "$out/$name.kills"
    first=$(awk "BEGIN { print int($(value undisturbed first_init_s) * 30) + 15 }")
    disturbed "$name" "$first" $((frames * 9 / 10))
  fi
done
{
  echo "| run | kills | restarts | tracked online [%] | ATE final [m] | keyframes | missing | records lost | verdict |"
  echo "|---|---|---|---|---|---|---|---|---|"
  for name in undisturbed ${victims//,/ }; do
    wrong=$(verdict "$name")
    [[ -z $wrong ]] || failed=1
    printf '| %s | %s | %s | %.1f | %s | %s | %s | %s | %s |\n' "$name" "$(grep -c . "$out/$name.kills" 2>/dev/null || true)" \
      "$(value "$name" restarts)" "$(value "$name" tracked_online_percent)" "$(value "$name" ate_rmse_final | cut -c1-7)" \
      "$(value "$name" keyframes)" "$(value "$name" keyframes_missing)" "$(value "$name" records_lost)" "${wrong:-good}"
  done
} >"$out/table.md"
cat "$out/table.md"
exit "$failed"
