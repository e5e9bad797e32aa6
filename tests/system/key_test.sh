# With a key only those who have it are heard, and each of their messages once: forgeries of every kind, by who has no key or
# another one, and echoes of what was said before change no byte of the results. They are counted, and logged once.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
unset DMSLAM_KEY_FILE
key=$work/key other=$work/other_key
for file in "$key" "$other"; do
  (umask 077 && head -c 32 /dev/urandom | base64 >"$file")
done
sequence=(--sequence "$synthetic" --camera "$root/config/synthetic.yaml" --seed 3 --frames 100 --lockstep)
kinds=()
for kind in frame end camera take-over head record reset ack "done"; do kinds+=(--kind "$kind"); done
forge() { # PORT ARGUMENTS...: until the end of the test, or of the run
  local port=$1
  shift
  "$build/bin/forger" --lcm-url "udpm://239.255.76.67:$port?ttl=0" "$@" >>"$work/forged" 2>&1 &
  forgers+=($!)
}
forgers=()
stop_forging() {
  kill -TERM "${forgers[@]}" 2>/dev/null
  wait "${forgers[@]}"
  forgers=()
}
same() { # FOLDER: bytes of its results
  local file
  for file in trajectory.txt trajectory_online.txt keyframes.txt map.ply; do
    check "$file of '$1' has the same bytes" cmp "$work/quiet/$file" "$work/$1/$file"
  done
}

check "a run without a key ends with 0" run "${sequence[@]}" --out "$work/quiet" --port 23461
check "a run with a key ends with 0" run "${sequence[@]}" --out "$work/keyed" --port 23462 --key "$key" --record
same keyed
expect "with a key nothing is dropped" "$work/keyed" messages_dropped "== 0"
check "every message carries a tag" grep -qa KeyTag "$work/keyed/run.lcmlog"

forge 23463 "${kinds[@]}"
forge 23463 "${kinds[@]}" --keep-tag
forge 23463 "${kinds[@]}" --key "$other"
forge 23463 --kind replay
"$build/bin/dmslam-noise" --lcm-url "udpm://239.255.76.67:23463?ttl=0" --rate 1000 >/dev/null 2>&1 &
forgers+=($!)
check "a run among forgers ends with 0" env DMSLAM_KEY_FILE="$key" "$root/scripts/run.sh" --build-dir "$build" "${sequence[@]}" \
  --out "$work/attacked" --port 23463 --share-port
stop_forging
same attacked
expect "forgeries are counted" "$work/attacked" messages_dropped ">= 1000"
expect "nothing is lost" "$work/attacked" records_lost "== 0"
expect "nobody died of it" "$work/attacked" restarts "== 0"
for process in player frontend mapper loopcloser collector; do
  said=$(grep -c "refused a message" "$work/attacked/log/$process.log")
  ((said <= 4)) || failed "$process says $said times that it refuses messages: once for each reason is enough"
done
check "it is logged" grep -q "refused a message on .* (further ones are only counted)" "$work/attacked/log/frontend.log"

# A whole log of another session, with tags of the same key: its senders are gone.
lcm-logplayer -s 0.5 -l "udpm://239.255.76.67:23466?ttl=0" "$work/keyed/run.lcmlog" >/dev/null 2>&1 &
forgers+=($!)
check "a run beside a ghost ends with 0" run "${sequence[@]}" --out "$work/haunted" --port 23466 --share-port --key "$key"
stop_forging
same haunted
expect "the ghost is counted" "$work/haunted" messages_dropped ">= 100"

# Processes that were killed come back and are heard; what the dead have said is repeated all the time, and is not.
forge 23468 --kind replay
run "${sequence[@]}" --out "$work/killed" --port 23468 --share-port --key "$key" >"$work/killed.said" 2>&1 &
runner=$!
for victim in mapper loopcloser; do
  for ((i = 0; i < 600; ++i)); do
    grep -qs "frame [0-9]* of" "$work/killed/log/collector.log" && break
    sleep 0.05
  done
  sleep 0.5
  kill -KILL "$(<"$work/killed/log/$victim.pid")" || failed "$victim was not there to be killed"
done
check "the run with killed processes ends with 0" wait $runner
stop_forging
expect "they were started again" "$work/killed" restarts "== 2"
expect "nothing is lost with them" "$work/killed" records_lost "== 0"
expect "the frames are tracked" "$work/killed" tracked_percent ">= 60"

# What a logger records, who has no key, holds forgeries as well; the key tells them apart. (Few of them: it queues 30 messages.)
forge 23467 --kind record --kind end --kind reset --kind frame
check "a run with a few forgeries is recorded" run "${sequence[@]}" --out "$work/recorded" --port 23467 --share-port --key "$key" --record
stop_forging
map() { "$build/bin/dmslam-map" "$@"; }
for which in keyed recorded; do
  check "the map of '$which' is rebuilt" map --log "$work/$which/run.lcmlog" --key "$key" --ply "$work/$which.ply" >"$work/$which.said" 2>&1
  check "it is the run's" cmp "$work/quiet/map.ply" "$work/$which.ply"
done
check "what was left out is said" grep -q "[0-9]* messages have no tag that fits the key and were left out" "$work/recorded.said"
check "and only that" test "$(grep -c "no tag that fits" "$work/keyed.said")" = 0
(umask 077; head -c 32 /dev/urandom | base64 >"$work/wrong.key")
check "with another key it can be read" map --log "$work/keyed/run.lcmlog" --key "$work/wrong.key" --ply "$work/wrong.ply" >"$work/wrong.said" 2>&1
check "but not without a word" grep -q "nothing in it is verified" "$work/wrong.said"
check "without the key too, where nobody forged" map --log "$work/keyed/run.lcmlog" --ply "$work/open.ply" >"$work/said"
check "it is the run's own" cmp "$work/quiet/map.ply" "$work/open.ply"
check "the owner plays the log again" run --log "$work/recorded/run.lcmlog" --seed 3 --lockstep --key "$key" --out "$work/again" --port 23464
same again

refused "--replay plays by lcm-logplayer, which has no key; --log" run --replay "$work/keyed/run.lcmlog" --key "$key" --out "$work/replayed"
chmod 644 "$key"
refused "the key $key can be read by others .*chmod 600 $key" run "${sequence[@]}" --key "$key" --out "$work/o"
chmod 600 "$key"
: >"$work/empty"
chmod 600 "$work/empty"
refused "has 0 bytes; wanted are 32" run "${sequence[@]}" --key "$work/empty" --out "$work/o"

# The scripts that measure it.
check "a key costs little" "$root/scripts/key_cost.sh" --sequence "$synthetic" --camera "$root/config/synthetic.yaml" --frames 40 \
  --build-dir "$build" --out "$work/cost" >"$work/said" 2>&1
check "all five say what it cost" test "$(grep -cE '^\| (player|frontend|mapper|loopcloser|collector) ' "$work/cost/table.md")" = 5
check "one kind of forgery is measured" "$root/scripts/forgeries.sh" --kinds ack --build-dir "$build" --out "$work/table" >"$work/said" 2>&1
check "it is refused with a key" grep -qE '^\| `ack` \| .* \| same bytes \| [1-9][0-9]* \|$' "$work/table/table.md"

# The forgers are in earnest: without a key the same ones ruin the run.
forge 23465 "${kinds[@]}"
timeout 60 "$root/scripts/run.sh" --build-dir "$build" "${sequence[@]}" --out "$work/ruined" --port 23465 --share-port >/dev/null 2>&1 &&
  cmp -s "$work/quiet/trajectory.txt" "$work/ruined/trajectory.txt" && failed "without a key the forgeries change nothing: they prove nothing"
stop_forging
finish
