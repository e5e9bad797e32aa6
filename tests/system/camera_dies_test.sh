# Two cameras in one room, in real time: a frontend dies. The other one goes on, and nobody else notices.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
source "$(dirname "$0")/two_cameras.sh"

run "${sequences[@]}" --speed 0.4 --out "$work/killed" >"$work/killed.txt" 2>&1 &
pid=$!
for ((i = 0; i < 200; ++i)); do
  [[ ! -s $work/killed/log/frontend1.pid ]] || break
  sleep 0.05
done
sleep 6
check "it is killed" kill -KILL "$(cat "$work/killed/log/frontend1.pid")"
wait "$pid"
check "the run ends with 0 all the same" test $? -eq 0
no_orphans "the run in real time"
check "it was started again" grep -q "frontend1 was ended by signal 9; started again" "$work/killed.txt"
expect "it was the only one" "$work/killed" restarts "== 1"
check "both cameras are in one map in the end, after that" one_map "$work/killed"
expect "and lie right to one another" "$work/killed" ate_rmse_joint "<= 0.02"
expect "no keyframe is missing, after that" "$work/killed" keyframes_missing "== 0"
expect_camera "the other one is undisturbed" "$work/killed" 0 tracked_percent ">= 90"
for camera in 0 1; do
  expect_camera "all frames were played" "$work/killed" "$camera" frames "== 150"
  counted=0
  for key in frames_processed frames_skipped frames_lost; do counted+=+$(camera_field "$work/killed" "$camera" "$key"); done
  expect_camera "each frame is accounted for" "$work/killed" "$camera" frames "== $counted"
done
expect_camera "those that came while there was no frontend are lost, which is told of its camera" "$work/killed" 1 frames_lost ">= 3"
expect_camera "it has found itself again" "$work/killed" 1 tracked_online_percent ">= 30"
finish
