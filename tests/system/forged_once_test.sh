# One forged message of each kind, and of those that speak of what is played five in a tenth of a second, by who knows the protocol
# and has no key, in the middle of a run: it goes on to its end, nobody dies of it, hangs or is deaf to what comes after it.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
unset DMSLAM_KEY_FILE
sequence=(--sequence "$synthetic" --camera "$root/config/synthetic.yaml" --seed 3 --frames 70 --lockstep)
port=23500
forged() { # KIND TIMES: a run beside such a forger
  local name=$1_$2 forger
  port=$((port + 1))
  "$build/bin/forger" --lcm-url "udpm://239.255.76.67:$port?ttl=0" --kind "$1" --times "$2" --from-frame 40 >"$work/$name.forged" 2>&1 &
  forger=$!
  check "a run with $2 x '$1' ends with 0" timeout 120 "$build/bin/dmslam-run" "${sequence[@]}" --out "$work/$name" --port $port \
    --share-port >"$work/$name.said" 2>&1
  kill -TERM $forger 2>/dev/null
  wait $forger
  no_orphans "$name"
  grep -q '^[1-9][0-9]* forged messages' "$work/$name.forged" || failed "nothing was forged: $(<"$work/$name.forged")"
  echo "$name: $(<"$work/$name.forged"), tracked $(field "$work/$name" tracked_percent) %, dropped $(field "$work/$name" messages_dropped)"
  expect "$name: the sequence was played to its end" "$work/$name" frames "== 70"
  expect "$name: nobody was started again" "$work/$name" restarts "== 0"
  expect "$name: what comes after it is tracked" "$work/$name" tracked_percent ">= 85"
}
for kind in take-over head record reset ack; do forged "$kind" 1; done
for kind in frame far-frame end camera "done" far-done sequence-done; do
  forged "$kind" 1
  forged "$kind" 5
done
finish
