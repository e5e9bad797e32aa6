# Logs of a run are worth keeping: they play again byte for byte, hold the map, and do not disturb a system that is alive.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast

camera=$root/config/synthetic.yaml
check "the recorded run ends with 0" run --sequence "$synthetic" --camera "$camera" --seed 3 --frames 110 --lockstep \
  --record --save-map "$work/mapper.map" --out "$work/first"
log=$work/first/run.lcmlog
same_as_first() { # FOLDER
  local file
  for file in trajectory.txt trajectory_online.txt keyframes.txt map.ply; do
    check "$file of '$1' has the same bytes" cmp "$work/first/$file" "$work/$1/$file"
  done
}

check "the log plays in lock-step" run --log "$log" --seed 3 --lockstep --out "$work/again"
same_as_first again
expect "its ground truth is in the log" "$work/again" ate_rmse_final "<= 0.05"
check "the log plays in one process" "$build/bin/dmslam-inprocess" --log "$log" --seed 3 --out "$work/one"
same_as_first one
check "a folder becomes a log" "$build/bin/dmslam-player" --sequence "$synthetic" --camera "$camera" --frames 110 \
  --to-log "$work/made.lcmlog"
check "that log plays" "$build/bin/dmslam-inprocess" --log "$work/made.lcmlog" --seed 3 --out "$work/made"
same_as_first made

map() { "$build/bin/dmslam-map" "$@"; }
check "the map is rebuilt" map --log "$log" --save "$work/rebuilt.map" --ply "$work/rebuilt.ply" \
  --trajectory "$work/rebuilt.txt" >"$work/said" 2>&1
check "it is the mapper's own" cmp "$work/mapper.map" "$work/rebuilt.map"
check "its points too" cmp "$work/first/map.ply" "$work/rebuilt.ply"
check "its trajectory too" cmp "$work/first/trajectory.txt" "$work/rebuilt.txt"
check "nothing is missing" grep -q " 0 missing" "$work/said"
check "nor of the frontend's records" test "$(grep -c "are missing" "$work/said")" = 0
seconds=$(sed -nE 's/^log .* ([0-9.]+) s,.*/\1/p' "$work/said")
for ((tenth = 1; tenth < 10; ++tenth)); do
  map --log "$log" --at "$(awk "BEGIN { print $seconds * $tenth / 10 }")" --save "$work/part.map" >/dev/null 2>&1 && break
done
check "an earlier map is a smaller one" test "$(wc -c <"$work/part.map")" -lt "$(wc -c <"$work/mapper.map")"

# The proof of a landmark: which keyframes, which decision, which seed.
check "all landmarks are proven" map landmark "$log" --all --json "$work/proofs.json" >"$work/said"
check "of each is told what made it" test "$(grep -c '"decision":"\(not told\|other\)"' "$work/proofs.json")" = 0
proven=$(grep -cE '^\{"id":"[0-9:]+","state":"(static|moving)"' "$work/proofs.json")
check "as many are there as the map has" grep -q " $proven landmarks " <(map list "$work/mapper.map")
one_with() { sed -nE "s/^\{\"id\":\"([0-9:]+)\",$1.*/\1/p" "$work/proofs.json" | tail -n 1; } # PATTERN
made=$(one_with '"state":"static".*"decision":"triangulated".*"end":null')
check "a landmark of the run is proven" map landmark "$log" "$made" >"$work/proof" 2>&1
for words in "^landmark +$made " "seed 3, configuration [0-9a-f]{16}" "in the map, static" \
  "triangulated from frame [0-9]+ and [0-9]+ more" "LANDMARKS_CREATED about frame" "^seen by +[0-9]+ keyframes"; do
  check "its proof says '$words'" grep -qE "$words" "$work/proof"
done
seen() { sed -n '/^seen by/,/^[a-z]/p' | grep -E '^(seen| )'; }
check "the saved map knows it, too" map landmark "$work/mapper.map" "$made" >"$work/saved_proof" 2>&1
check "it is seen by the same, with the same errors" cmp <(seen <"$work/proof") <(seen <"$work/saved_proof")
check "what only the log can tell is said" grep -q "the log of its run does" "$work/saved_proof"
check "one that became another says which" grep -qE "fused into [0-9:]+" \
  <(map landmark "$log" "$(one_with '"state":"fused"')")
check "one that went says by which rule" grep -qE "removed.*: (found in|no more than|keyframes of another|it moves)" \
  <(map landmark "$log" "$(one_with '"state":"removed".*"decision":"(rarely found|few observers|seen through|moved)"')")
refused "run.lcmlog: knows no landmark 1:99999999: it holds [0-9]+ .*--all --json" map landmark "$log" 1:99999999
refused "mapper.map: knows no landmark 7:1: .* only the run's log tells" map landmark "$work/mapper.map" 7:1
refused "'217x': is no landmark's name; give ORDINAL:NUMBER" map landmark "$log" 217x

size=$(wc -c <"$log")
head -c $((size * 2 / 3)) "$log" >"$work/cut.lcmlog"
printf 'damage' | dd of="$work/cut.lcmlog" bs=1 seek=$((size / 2)) conv=notrunc 2>/dev/null
check "a damaged log is read" map --log "$work/cut.lcmlog" --save "$work/cut.map" >"$work/said" 2>&1
check "what was skipped is said" grep -q "skipped.*its end" "$work/said"
refused "no LCM log" map --log "$camera"
refused "several sessions|holds no session" map --log "$log" --log-session 5
refused "higher one with --session" "$build/bin/dmslam-inprocess" --log "$log" --map "$log" --session 1 --out "$work/o"

check "the map is found again" run --log "$log" --lockstep --map "$work/mapper.map" --localize --out "$work/localized"
expect "frames are localised" "$work/localized" tracked_online_percent ">= 90"
check "the map stays as it was" cmp "$work/first/map.ply" "$work/localized/map.ply"
check "the map goes on" "$build/bin/dmslam-inprocess" --log "$log" --map "$log" --out "$work/goes_on"
expect "frames are tracked in it" "$work/goes_on" tracked_online_percent ">= 90"

# A mapper alone makes a map of the recorded keyframes, in one process and in two.
check "the records are entered" "$build/bin/dmslam-inprocess" --records "$log" --session 9 --seed 3 --out "$work/records"
expect "the frames have their places in it" "$work/records" tracked_percent ">= 90"
for file in trajectory.txt keyframes.txt map.ply; do
  check "$file is the same as with images" cmp "$work/first/$file" "$work/records/$file"
done
bus=(--lcm-url "udpm://239.255.76.67:23872?ttl=0" --session 9 --peers frontend,mapper --fresh-system --set seed=3)
"$build/bin/dmslam-mapper" "${bus[@]}" --save-map "$work/alone.map" 2>"$work/said" &
mapper=$!
check "the player enters them" "$build/bin/dmslam-player" "${bus[@]}" --log "$log" --channels records 2>>"$work/said"
check "the mapper alone ends with 0" wait $mapper
check "it saves a map" map --log "$work/alone.map" --ply "$work/alone.ply" >/dev/null
check "the same as in one process" cmp "$work/records/map.ply" "$work/alone.ply"

# The whole log, with all its records and beacons, beside a run.
port=23871
run --sequence "$synthetic" --camera "$camera" --seed 3 --frames 110 --lockstep --port $port --out "$work/haunted" &
runner=$!
lcm-logplayer -s 2 -l "udpm://239.255.76.67:$port?ttl=0" "$log" >/dev/null 2>&1
check "a run beside a ghost ends with 0" wait $runner
same_as_first haunted
expect "the ghost is counted" "$work/haunted" dropped_of_other_sessions ">= 100"
no_orphans "the ghost"
finish
