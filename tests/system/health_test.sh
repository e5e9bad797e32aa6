# What /healthz and /metrics of the viewer say: a run is well; a collector that is stopped is named, and well again when it goes on.
source "$(dirname "$0")/lib.sh"
skip() { echo "SKIPPED: $*"; exit $SKIPPED; }
[[ -x $build/bin/dmslam-viewer ]] || skip "dmslam-viewer was not built"
command -v curl >/dev/null || skip "curl is missing"
need_synthetic
multicast
common=(--lcm-url "udpm://239.255.76.67:23471?ttl=0&recv_buf_size=4194304" --session 7)
begin() { # PROCESS OPTION...
  local process=$1
  shift
  "$build/bin/dmslam-$process" "${common[@]}" "$@" >>"$work/$process.log" 2>&1 </dev/null &
  pid=$!
}
get() { curl --silent --max-time 5 --noproxy '*' "$@"; }
answer() { get --output "$work/health" --write-out '%{http_code}' "${address}healthz"; } # the text is in $work/health
says() { # CODE PATTERN: within ten seconds
  local i code
  for ((i = 0; i < 100; ++i)); do
    code=$(answer)
    [[ $code == "$1" ]] && grep -q "$2" "$work/health" && return
    sleep 0.1
  done
  failed "/healthz does not come to say $1 and $2, but $code: $(<"$work/health")"
}
metric() { # LINE, a pattern: within five seconds
  local i
  for ((i = 0; i < 50; ++i)); do
    get --output "$work/metrics" "${address}metrics"
    ! grep -q "^dmslam_$1$" "$work/metrics" || return
    sleep 0.1
  done
  failed "/metrics does not say $1 but $(grep "${1%%[\{ ]*}" "$work/metrics")"
}

begin viewer --http 127.0.0.1:0 --peers frontend,mapper,loopcloser,collector; viewer=$pid
for ((i = 0; i < 200; ++i)); do
  address=$(grep -oE 'http://[^ ]+/' "$work/viewer.log" | head -n 1)
  [[ -z $address ]] || break
  kill -0 "$viewer" 2>/dev/null || { grep -q 'libjs' "$work/viewer.log" && skip "$(<"$work/viewer.log")"; break; }
  sleep 0.05
done
says 503 '"collector": "awaited"'
begin mapper --fresh-system
begin frontend --fresh-system
begin loopcloser --fresh-system
begin collector --fresh-system --out "$work/out"; collector=$pid
begin player --fresh-system --sequence "$synthetic" --camera "$root/config/synthetic.yaml" --speed 0.2 --lead 1
says 200 '"collector": "up"'
metric 'up{process="collector"} 1'
metric 'cpu_percent{process="frontend"} [0-9.]*[1-9][0-9.]*'
kill -STOP "$collector"
says 503 '"collector": "down"'
metric 'up{process="collector"} 0'
metric 'up{process="mapper"} 1'
kill -CONT "$collector"
says 200 '"collector": "back"'
metric 'restarts_total{process="collector"} 0'
check "the collector ends with 0" wait "$collector"
kill -TERM "$viewer"
check "the viewer ends with 0" wait "$viewer"
no_orphans "the run"
finish
