# Two cameras by hand, the second one in another terminal, later: the first one's frames wait for the mapper, which asks
# everybody for a map, and none is skipped meanwhile. At the end all say for whom they wait.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
common=(--lcm-url "udpm://239.255.76.67:23491?ttl=0&recv_buf_size=4194304" --session 1 --cameras 2)
begin() { exec "$build/bin/dmslam-$1" "${common[@]}" "${@:2}" >"$work/$1.log" 2>&1 </dev/null; }
for process in mapper loopcloser frontend; do begin "$process" & done
begin collector --out "$work/out" &
begin player --sequence "$synthetic" --camera "$root/config/synthetic.yaml" --frames 60 --speed 0.5 &
says "waiting for mapper" player
says "waiting for frontend1" mapper collector
check "it is said once" test "$(grep -c "waiting for mapper" "$work/player.log")" = 1
while IFS=: read -r pid _; do kill -TERM "$pid"; done < <(mine)
no_orphans "the run"
expect "all frames came to the frontend" "$work/out" frames_skipped "== 0"
finish
