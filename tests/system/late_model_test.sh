# A camera of another model that comes late is refused, though its number is lower: who is in the map already goes on.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
common=(--lcm-url "udpm://239.255.76.67:23497?ttl=0&recv_buf_size=4194304" --session 3 --cameras 2)
begin() { # LOG PROCESS OPTION...
  exec "$build/bin/dmslam-$2" "${common[@]}" "${@:3}" >"$work/$1.log" 2>&1 </dev/null
}
for process in mapper loopcloser; do begin "$process" "$process" & done
begin collector collector --out "$work/out" &
begin frontend1 frontend --camera-id 1 &
first=$!
begin player1 player --camera-id 1 --sequence "$synthetic" --camera "$root/config/synthetic.yaml" --speed 0.5 &
says "frame [0-9]+ of [0-9]+, [1-9][0-9]* keyframes" collector

sed -E 's/^( *fx[^:]*: *).*/\1400.0/' "$root/config/synthetic.yaml" >"$work/other.yaml"
begin player0 player --sequence "$synthetic" --camera "$work/other.yaml" &
timeout 30 "$build/bin/dmslam-frontend" "${common[@]}" >"$work/frontend0.log" 2>&1
status=$?
check "a frontend with another camera model ends with 2 (not $status)" test "$status" -eq 2
check "and says why: $(<"$work/frontend0.log")" grep -q "camera 0 is another model than camera 1" "$work/frontend0.log"
check "the one that was first goes on: $(<"$work/frontend1.log")" kill -0 "$first"
frame_now() { grep -oE "frame [0-9]+ of" "$work/collector.log" | tail -n 1; }
before=$(frame_now)
for ((i = 0; i < 200; ++i)); do [[ $(frame_now) == "$before" ]] || break; sleep 0.05; done
check "its frames go on being tracked (behind $before)" test "$(frame_now)" != "$before"
while IFS=: read -r pid _; do kill -TERM "$pid"; done < <(mine)
no_orphans "the run"
check "nothing of the refused camera is in the map" grep -q '"camera": 1,' "$work/out/summary.json"
finish
