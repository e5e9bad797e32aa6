# A second player on the same session is refused by name; the run of the first one is as if it had not come.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
common=(--lcm-url "udpm://239.255.76.67:23441?ttl=0&recv_buf_size=4194304" --session 7 --set seed=3)
for process in mapper frontend loopcloser; do
  "$build/bin/dmslam-$process" "${common[@]}" --fresh-system >"$work/$process.log" 2>&1 </dev/null &
done
"$build/bin/dmslam-collector" "${common[@]}" --fresh-system --out "$work/out" >"$work/collector.log" 2>&1 </dev/null &
collector=$!
player=("$build/bin/dmslam-player" "${common[@]}" --sequence "$synthetic" --camera "$root/config/synthetic.yaml" --lockstep)
"${player[@]}" --fresh-system >"$work/first.log" 2>&1 </dev/null &
first=$!
until grep -qs "frame [0-9]* of" "$work/collector.log" || ! kill -0 "$collector" 2>/dev/null; do sleep 0.05; done
status=0
"${player[@]}" --start 20 >"$work/second.log" 2>&1 </dev/null || status=$?
((status == 3)) || failed "the second player ended with $status: $(<"$work/second.log")"
check "it is told who plays: $(<"$work/second.log")" grep -q "session 7: player on .*(pid $first) writes this stream already" "$work/second.log"
check "the first one ends well: $(<"$work/first.log")" wait "$first"
check "the collector ends well: $(<"$work/collector.log")" wait "$collector"
no_orphans "the run"
check "a run without disturbance" "$build/bin/dmslam-inprocess" --sequence "$synthetic" --camera "$root/config/synthetic.yaml" \
  --seed 3 --out "$work/alone" >/dev/null 2>&1
check "its bytes are those of a run without disturbance" cmp "$work/out/trajectory.txt" "$work/alone/trajectory.txt"
finish
