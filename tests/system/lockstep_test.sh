# The four processes on a rendered sequence in lock-step; the same seed again, with a receive buffer of 212992 bytes; and
# in one process: the same bytes each time.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast

sequence=(--sequence "$synthetic" --camera "$root/config/synthetic.yaml" --seed 3)
check "the run ends with 0" run "${sequence[@]}" --lockstep --out "$work/first" --pictures 40
no_orphans "the run"
for file in trajectory.txt trajectory_online.txt poses_online.csv keyframes.txt map.ply trajectory.png summary.json; do
  check "$file is there" test -s "$work/first/$file"
done
check "pictures are drawn" test -n "$(ls "$work/first/pictures")"
expect "most of the sequence is tracked" "$work/first" tracked_online_percent ">= 50"
expect "the trajectory is right" "$work/first" ate_rmse_final "<= 0.05"
expect "nothing is skipped" "$work/first" frames_skipped "== 0"
expect "nothing is lost" "$work/first" records_lost "== 0"
expect "nobody was restarted" "$work/first" restarts "== 0"
check "the summary names the version" grep -qF "\"version\": \"$("$build/bin/dmslam-inprocess" --version)\"" \
  "$work/first/summary.json"
check "and the machine" grep -q "\"cores\": [1-9]" "$work/first/summary.json"

check "a run with a small buffer ends with 0" run "${sequence[@]}" --lockstep --out "$work/small" --receive-buffer 212992
expect "nothing is lost with a small buffer" "$work/small" records_lost "== 0"
check "in one process it ends with 0" "$build/bin/dmslam-inprocess" "${sequence[@]}" --out "$work/one"
for other in small one; do
  for file in trajectory.txt trajectory_online.txt poses_online.csv keyframes.txt map.ply; do
    check "$file of '$other' has the same bytes" cmp "$work/first/$file" "$work/$other/$file"
  done
done
# What was seen before there was a map is mapped when the sequence has ended, in lock-step processes as in one.
readonly EAGER=(--set keyframe.tracked_ratio=1)
check "it ends with 0 with more keyframes" run "${sequence[@]}" "${EAGER[@]}" --lockstep --out "$work/eager"
check "in one process too" "$build/bin/dmslam-inprocess" "${sequence[@]}" "${EAGER[@]}" --out "$work/with"
check "and without keyframes at the end" "$build/bin/dmslam-inprocess" "${sequence[@]}" "${EAGER[@]}" \
  --set keyframe.at_end=off --out "$work/without"
proposed() { sed -n 's/.*"keyframes_proposed": \([0-9]*\).*/\1/p' "$work/$1/summary.json"; }
check "frames from before the map become keyframes" test "$(proposed with)" -gt "$(proposed without)"
check "what was tracked stays as it was" cmp "$work/with/trajectory_online.txt" "$work/without/trajectory_online.txt"
for file in trajectory.txt keyframes.txt map.ply; do
  check "$file of the processes has the same bytes" cmp "$work/eager/$file" "$work/with/$file"
done
check "another seed ends with 0" "$build/bin/dmslam-inprocess" "${sequence[@]:0:4}" --seed 4 --out "$work/other"
expect "the summary names the seed" "$work/other" seed "== 4"
finish
