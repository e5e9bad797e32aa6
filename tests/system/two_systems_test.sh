# Two systems on one bus: the second one's collector is refused by name, one that has died is followed by another at once;
# a process that was not told its session does not guess between two; dmslam-run leaves a session alone that others play.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
bus='udpm://239.255.76.67:23481?ttl=0&recv_buf_size=4194304'
common=(--lcm-url "$bus" --set seed=3)
camera=$root/config/synthetic.yaml
begin() { exec "$build/bin/dmslam-$1" "${common[@]}" "${@:2}" </dev/null; }
ends_with() { # CODE PID LOG
  local status=0
  wait "$2" || status=$?
  ((status == $1)) || failed "$3 ended with $status instead of $1: $(<"$work/$3.log")"
}

for process in mapper frontend loopcloser; do
  begin "$process" --session 5 --fresh-system >"$work/$process.log" 2>&1 &
done
begin collector --session 5 --fresh-system --out "$work/out" >"$work/collector.log" 2>&1 &
collector=$!
begin player --session 5 --fresh-system --sequence "$synthetic" --camera "$camera" --lockstep >"$work/player.log" 2>&1 &
player=$!
until grep -qs "frame [0-9]* of" "$work/collector.log" || ! kill -0 "$collector" 2>/dev/null; do sleep 0.05; done
begin player --session 6 --fresh-system --sequence "$synthetic" --camera "$camera" --speed 0.2 >"$work/other.log" 2>&1 &
other=$!
begin collector --session 5 --out "$work/second" >"$work/second.log" 2>&1 &
second=$!
begin mapper >"$work/unsure.log" 2>&1 &
ends_with 2 $! unsure
check "it names both: $(<"$work/unsure.log")" grep -qE \
  "two sessions are on this bus \(5: player on .* pid $player; 6: player on .* pid $other\): choose one with --session" "$work/unsure.log"
ends_with 3 "$second" second
check "it is told by whom: $(<"$work/second.log")" grep -q \
  "session 5: collector on .*(pid $collector) writes results of this session already: stop it, or give another --session, --prefix or port" \
  "$work/second.log"
check "it has written nothing" test ! -e "$work/second"
kill -KILL "$collector"
begin collector --session 5 --out "$work/out" >"$work/follower.log" 2>&1 &
ends_with 0 $! follower
check "the player ends well: $(<"$work/player.log")" wait "$player"
kill "$other"
no_orphans "the run"
expect "one restart, of the collector that was killed" "$work/out" restarts "== 1"
check "a run without disturbance" "$build/bin/dmslam-inprocess" --sequence "$synthetic" --camera "$camera" --seed 3 --out "$work/alone" >/dev/null 2>&1
check "its bytes are those of a run without disturbance" cmp "$work/out/trajectory.txt" "$work/alone/trajectory.txt"

# Runs that begin in one saved map draw their sessions behind the map's: two of them on one port are two.
session_of() { sed -nE 's/.*"session": *([0-9]+).*/\1/p' "$work/$1/run.json"; }
check "a map is saved" run --sequence "$synthetic" --camera "$camera" --frames 60 --lockstep --save-map "$work/a.map" --out "$work/a" >"$work/a.log" 2>&1
declare -A runs
for name in first second; do
  run --sequence "$synthetic" --camera "$camera" --lockstep --map "$work/a.map" --port 23481 --share-port --out "$work/in_$name" >"$work/in_$name.log" 2>&1 &
  runs[$name]=$!
done
for name in first second; do wait "${runs[$name]}" || failed "the $name run in that map: $(<"$work/in_$name.log")"; done
check "their sessions differ" test "$(session_of in_first)" -ne "$(session_of in_second)"
for name in first second; do
  check "that of the $name comes after the map's" test "$(session_of "in_$name")" -gt "$(session_of a)"
  check "what the $name is told is its own" cmp "$work/in_first/trajectory.txt" "$work/in_$name/trajectory.txt"
done

# A run is not resumed while somebody else plays its session.
set -m # a process group of its own, with the interrupt signal not ignored
"$root/scripts/run.sh" --build-dir "$build" --sequence "$synthetic" --camera "$camera" --speed 0.2 --port 23481 --share-port \
  --out "$work/b" >"$work/b.said" 2>&1 </dev/null &
runner=$!
set +m
until [[ -s $work/b/checkpoint.lcmlog ]]; do
  kill -0 "$runner" 2>/dev/null || break
  sleep 0.05
done
kill -INT -- "-$runner"
wait "$runner" || true
session=$(session_of b)
before=$(cksum "$work/b/summary.json" "$work/b/run.json")
begin player --session "$session" --fresh-system --sequence "$synthetic" --camera "$camera" --speed 0.2 >"$work/other.log" 2>&1 &
other=$!
sleep 0.5
status=0
run --resume "$work/b" >"$work/b.log" 2>&1 || status=$?
((status == 3)) || failed "dmslam-run ended with $status: $(<"$work/b.log")"
check "it says who plays: $(<"$work/b.log")" grep -q "session $session: player on .*(pid $other) writes this session already" "$work/b.log"
check "its results stay as they are" test "$before" = "$(cksum "$work/b/summary.json" "$work/b/run.json")"
check "nothing has happened to the player: $(<"$work/other.log")" kill "$other"
no_orphans "the second run"
finish
