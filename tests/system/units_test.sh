# The command lines of the systemd units, with the settings file that is installed beside them, make a whole run; what dies
# of a signal is started again as Restart=on-failure does, and the others go on; where all died the mapper goes on from the
# collector's checkpoint.
source "$(dirname "$0")/lib.sh"
source "$(dirname "$0")/units.sh"
need_synthetic

set_system "DMSLAM_LCM_URL=udpm://239.255.76.67:23421?ttl=0&recv_buf_size=4194304" "DMSLAM_OUT=$work/out" \
  "DMSLAM_SEQUENCE=$synthetic" "DMSLAM_PLAYER_OPTIONS=--camera $root/config/synthetic.yaml --lockstep"
check "the channels of two NAMEs are apart: $DMSLAM_OPTIONS" test "$DMSLAM_OPTIONS" = "--prefix NAME/"
for process in "${units[@]}"; do
  supervise "$process" &
  [[ $process != collector ]] || collector=$!
done
# There is no network yet: everybody is started again until there is.
for process in "${units[@]}"; do
  for ((i = 0; i < 400; ++i)); do grep -qs "ended with 7" "$work/$process.restarts" && break; sleep 0.05; done
  check "$process waits for the network: $(tail -n 1 "$work/$process.log")" grep -qs "ended with 7" "$work/$process.restarts"
done
multicast
until grep -qs 'frame [0-9]* of' "$work/collector.log"; do
  kill -0 "$collector" 2>/dev/null || break
  sleep 0.05
done
kill -KILL "$(mine | sed -nE 's/^([0-9]+): .*bin\/dmslam-mapper .*/\1/p')"
until grep -qs 'frame [6-9][0-9] of' "$work/collector.log" && [[ -s $work/out/checkpoint.lcmlog ]]; do
  kill -0 "$collector" 2>/dev/null || break
  sleep 0.05
done
mapfile -t all < <(mine | cut -d: -f1)
check "all five are there when they are killed: ${all[*]}" test "${#all[@]}" -eq 5
kill -KILL "${all[@]}"
wait "$collector" || failed "the collector ended with $?; its log: $(tail -n 3 "$work/collector.log")"
check "the mapper was started again" grep -qs "ended with 137" "$work/mapper.restarts"
check "results are in DMSLAM_OUT" test -s "$work/out/trajectory.txt"
check "the mapper goes on from the checkpoint" grep -qs "checkpoint.lcmlog: continues with" "$work/mapper.log"
expect "all had died" "$work/out" resumed "== 1"
expect "all frames are there" "$work/out" frames "== 150"
expect "nothing is lost" "$work/out" records_lost "== 0"
expect "no keyframe is missing" "$work/out" keyframes_missing "== 0"
expect "the collector saw the restarts" "$work/out" restarts ">= 1"
no_orphans "the run"
finish
