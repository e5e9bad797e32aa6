# Somebody who knows the protocol and has no key forges messages in the middle of a run: one of each kind, or five in a tenth of a
# second of those that speak of what is played, ask for a stream or name a term that would leave none behind it. The run goes on to
# its end: nobody dies of it, hangs, or ignores what comes after. DMSLAM_FORGED_TIMES="1 5" (scripts/nightly.sh) also sends one of
# those.
source "$(dirname "$0")/lib.sh"
port=23500
source "$(dirname "$0")/forging.sh"
forged() { # KIND TIMES: it does no harm
  beside "$1" "$2"
  ((status == 0)) || failed "a run with $2 x '$1' ended with $status: $(tail -n 3 "$work/$name.said")"
  echo "$name: $(<"$work/$name.forged"), tracked $(field "$work/$name" tracked_percent) %, dropped $(field "$work/$name" messages_dropped)"
  expect "$name: the sequence was played to its end" "$work/$name" frames "== 70"
  expect "$name: nobody was started again" "$work/$name" restarts "== 0"
  expect "$name: what comes after it is tracked" "$work/$name" tracked_percent ">= 85"
}
for kind in head record reset ack session; do forged "$kind" 1; done
for kind in take-over frame small-frame far-frame far-head end camera "done" far-done sequence-done; do
  for times in ${DMSLAM_FORGED_TIMES:-5}; do forged "$kind" "$times"; done
done
finish
