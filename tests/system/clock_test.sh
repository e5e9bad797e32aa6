# A mapper is killed, and started again on a host whose clock is an hour behind; then a frontend: both go on.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
common=(--lcm-url "udpm://239.255.76.67:23431?ttl=0&recv_buf_size=4194304" --session 7 --set seed=3)
begin() { # PROCESS OPTION...
  local process=$1
  shift
  "$build/bin/dmslam-$process" "${common[@]}" "$@" >>"$work/$process.log" 2>&1 </dev/null &
  pid=$!
}
again() { # PROCESS: killed, and begun an hour earlier; its id in $pid
  kill -KILL "$2"
  wait "$2" 2>/dev/null
  WRONG_CLOCK_S=-3600 LD_PRELOAD="$build/lib/libwrong_clock.so" begin "$1"
}
reached() { # FRAME: of the collector's log
  until [[ $(sed -nE 's/.*frame ([0-9]+) of .*/\1/p' "$work/collector.log" | tail -n 1) -ge $1 ]]; do
    kill -0 "$collector" 2>/dev/null || { failed "the run ended before frame $1"; return; }
    sleep 0.05
  done
}
begin mapper --fresh-system; mapper=$pid
begin frontend --fresh-system; frontend=$pid
begin loopcloser --fresh-system
begin collector --fresh-system --out "$work/out"; collector=$pid
begin player --fresh-system --sequence "$synthetic" --camera "$root/config/synthetic.yaml" --lockstep
reached 60
again mapper "$mapper"
reached 90
again frontend "$frontend"
check "the collector ends with 0" wait "$collector"
no_orphans "the run"
check "the mapper went on" grep -q "continues version" "$work/mapper.log"
check "nobody was taken over" test -z "$(grep -h "taken over" "$work"/*.log)"
expect "no keyframe is missing" "$work/out" keyframes_missing "== 0"
expect "nothing is lost" "$work/out" records_lost "== 0"
finish
