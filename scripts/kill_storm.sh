#!/usr/bin/env bash
# Kills processes all the time during one long run, and measures what it cost. See --help.
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
source "$top/scripts/lib/to_and_fro.sh"
usage() {
  cat <<'EOF'
Usage: scripts/kill_storm.sh --sequence DIR --out DIR [options]

Plays a TUM RGB-D folder in real time forwards, backwards, forwards ..., once undisturbed and once while, at seeded random moments,
a process that is drawn anew each time is ended by SIGKILL. Both run at the same time. The disturbed run must end by itself, hold
every keyframe that was proposed (or have culled it), lose no record but those that a frontend or a loop closer had not
delivered when it was killed, and have at most 1.5 times the undisturbed error, online and in the end. Writes DIR/table.md.

  --camera FILE      camera file (YAML)
  --kills N          how many (default 200)
  --seconds N        how long the sequence is (default 600)
  --victims LIST     with commas (default: frontend,mapper,loopcloser,collector,player)
  --seed N           of moments and victims (default 1)
  --build-dir DIR    where the programs are (default: build/release)
EOF
}
fail() { echo "kill_storm.sh: $*" >&2; exit 1; }

sequence="" out="" kills=200 seconds=600 victims=frontend,mapper,loopcloser,collector,player seed=1
build=$top/build/release camera=()
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --sequence | --out | --kills | --seconds | --victims | --seed)
      (($# > 1)) || fail "$1 needs a value (see --help)"
      printf -v "${1#--}" %s "$2"
      shift 2
      ;;
    --build-dir) build=$2; shift 2 ;;
    --camera) camera=(--camera "$2"); shift 2 ;;
    *) fail "unknown option $1 (see --help)" ;;
  esac
done
[[ -f $sequence/rgb.txt && -n $out ]] || fail "--sequence (a TUM RGB-D folder) and --out are needed (see --help)"
mkdir -p "$out"
to_and_fro "$sequence" "$seconds" "$out/sequence"

play() { # NAME: becomes the run
  exec "$build/bin/dmslam-run" --sequence "$out/sequence" "${camera[@]}" --seed 1 --out "$out/$1" >"$out/$1.said" 2>&1
}
value() { sed -nE "s/^ *\"$2\": *([^,]*),?$/\1/p" "$out/$1/summary.json" 2>/dev/null | head -n 1; }
# strike PROCESS: whether it was there to be killed, and is now dead.
strike() {
  local pid=0
  read -r pid 2>/dev/null <"$out/storm/log/$1.pid" || return 1
  [[ -r /proc/$pid/cmdline && $(tr '\0' ' ' <"/proc/$pid/cmdline") == *dmslam-$1\ * ]] || return 1
  kill -KILL "$pid" 2>/dev/null
}
# moments: when after the one before [s] and whom, a line for each kill; the pauses are even in 0.2 to 1.8 times their mean.
moments() {
  awk -v seed="$seed" -v kills="$kills" -v mean="$(awk "BEGIN { print ($seconds - 15) / $kills }")" -v list="$victims" 'BEGIN {
    srand(seed); n = split(list, name, ",")
    for (i = 0; i < kills; ++i) printf "%.2f %s\n", mean * (0.2 + 1.6 * rand()), name[1 + int(n * rand())] }'
}
storm() { # until all have been killed that are to be, or the run is over
  local pause victim
  until grep -qs "frame [0-9]* of" "$out/storm/log/collector.log" || ! kill -0 "$runner" 2>/dev/null; do sleep 0.1; done
  while read -r pause victim; do
    sleep "$pause"
    kill -0 "$runner" 2>/dev/null || return 0
    ! strike "$victim" || echo "$SECONDS $victim" >>"$out/kills"
  done < <(moments)
}
count() { if [[ $1 == undisturbed ]]; then echo 0; else wc -l <"$out/kills"; fi; } # NAME: of kills
verdict() { # STATUS of the disturbed run
  local wrong="" error died
  [[ $1 == 0 ]] || wrong+="it ended with $1; "
  [[ -s $out/storm/summary.json ]] || { echo "${wrong}no results"; return; }
  [[ $(count storm) == "$kills" ]] || wrong+="only $(count storm) of $kills were killed; "
  died=$(grep -cE 'frontend|loopcloser' "$out/kills" || true)
  awk -v lost="$(value storm records_lost)" -v died="$died" 'BEGIN { exit !(lost <= 10 * died) }' || wrong+="records lost; "
  [[ $(value storm keyframes_missing) == 0 ]] || wrong+="keyframes missing; "
  for error in online final; do
    awk -v error="$(value storm "ate_rmse_$error")" -v undisturbed="$(value undisturbed "ate_rmse_$error")" \
      'BEGIN { exit !(error > 0 && error <= 1.5 * undisturbed) }' || wrong+="$error error too large; "
  done
  [[ -z $(cut -d' ' -f1 "$out/storm/keyframes.txt" | grep -v '#' | sort | uniq -d) ]] || wrong+="a keyframe twice; "
  echo "$wrong"
}

rm -rf "${out:?}/storm" "$out/undisturbed"
: >"$out/kills"
play undisturbed &
undisturbed=$!
play storm &
runner=$!
trap 'kill -TERM "$runner" "$undisturbed" 2>/dev/null; wait; exit 130' INT TERM
storm
status=0
wait "$runner" || status=$?
wait "$undisturbed" || fail "the undisturbed run failed; see $out/undisturbed.said"
wrong=$(verdict "$status")
{
  echo "| run | kills | restarts | frames | tracked online / in the end [%] | ATE online / final [m] | keyframes | missing | records lost | resumed | verdict |"
  echo "|---|---|---|---|---|---|---|---|---|---|---|"
  for name in undisturbed storm; do
    printf '| %s | %s | %s | %s | %.1f / %.1f | %.4f / %.4f | %s | %s | %s | %s | %s |\n' "$name" \
      "$(count "$name")" "$(value "$name" restarts)" "$(value "$name" frames)" \
      "$(value "$name" tracked_online_percent)" "$(value "$name" tracked_percent)" "$(value "$name" ate_rmse_online)" \
      "$(value "$name" ate_rmse_final)" "$(value "$name" keyframes)" "$(value "$name" keyframes_missing)" \
      "$(value "$name" records_lost)" "$(value "$name" resumed)" "$([[ $name == undisturbed ]] || echo "${wrong:-good}")"
  done
} >"$out/table.md"
cat "$out/table.md"
[[ -z $wrong ]]
