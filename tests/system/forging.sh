# shellcheck shell=bash
# A run beside somebody who knows the protocol and has no key. Sourced behind lib.sh; `port` is the one before the first.
need_synthetic
multicast
unset DMSLAM_KEY_FILE
sequence=(--sequence "$synthetic" --camera "$root/config/synthetic.yaml" --seed 3 --frames 70 --lockstep)
beside() { # KIND TIMES: a run beside such a forger; sets `name` and `status`
  local forger
  name=$1_$2 status=0
  port=$((port + 1))
  "$build/bin/forger" --lcm-url "udpm://239.255.76.67:$port?ttl=0" --kind "$1" --times "$2" --from-frame 40 >"$work/$name.forged" 2>&1 &
  forger=$!
  timeout 300 "$build/bin/dmslam-run" "${sequence[@]}" --out "$work/$name" --port $port --share-port >"$work/$name.said" 2>&1 || status=$?
  kill -TERM $forger 2>/dev/null
  wait $forger
  no_orphans "$name"
  grep -q '^[1-9][0-9]* forged messages' "$work/$name.forged" || failed "nothing was forged: $(<"$work/$name.forged")"
}
