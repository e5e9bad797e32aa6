# One forged message of each kind, and of those that speak of what is played or ask for a stream five in a tenth of a second, by who
# knows the protocol and has no key, in the middle of a run: it goes on to its end, nobody dies of it, hangs or is deaf to what comes
# after it. Where somebody insists on taking over and never comes, the writers come back; who does so for ever ends the run.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
unset DMSLAM_KEY_FILE
sequence=(--sequence "$synthetic" --camera "$root/config/synthetic.yaml" --seed 3 --frames 70 --lockstep)
port=23500
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
forged() { # KIND TIMES: it does no harm
  beside "$1" "$2"
  ((status == 0)) || failed "a run with $2 x '$1' ended with $status: $(tail -n 3 "$work/$name.said")"
  echo "$name: $(<"$work/$name.forged"), tracked $(field "$work/$name" tracked_percent) %, dropped $(field "$work/$name" messages_dropped)"
  expect "$name: the sequence was played to its end" "$work/$name" frames "== 70"
  expect "$name: nobody was started again" "$work/$name" restarts "== 0"
  expect "$name: what comes after it is tracked" "$work/$name" tracked_percent ">= 85"
}
for kind in head record reset ack; do forged "$kind" 1; done
for kind in take-over frame small-frame far-frame end camera "done" far-done sequence-done; do
  forged "$kind" 1
  forged "$kind" 5
done

# For two seconds: all who write hand over, to nobody.
beside take-over 100
((status == 0)) || failed "a run with 100 x 'take-over' ended with $status: $(tail -n 3 "$work/$name.said")"
echo "$name: tracked $(field "$work/$name" tracked_percent) %, restarts $(field "$work/$name" restarts)"
expect "who handed over to nobody is started again" "$work/$name" restarts ">= 1"
expect "the sequence is played to its end all the same" "$work/$name" frames "== 70"
expect "no keyframe is missing" "$work/$name" keyframes_missing "== 0"

# For ever.
beside take-over 1000000
((status == 4)) || failed "a run in which somebody asks for ever ended with $status: $(tail -n 3 "$work/$name.said")"
check "it says why: $(<"$work/$name.said")" grep -q "forger asked for the stream, and nobody has gone on with it" "$work/$name.said"
finish
