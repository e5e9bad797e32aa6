# Two cameras in one room, each with a player and a frontend of its own, work on one map: in lock-step with the same bytes
# as in one process; what does not fit is refused. In real time: camera_dies_test.sh.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
source "$(dirname "$0")/two_cameras.sh"

check "the run ends with 0" run "${sequences[@]}" --lockstep --out "$work/first"
no_orphans "the run"
readonly RESULTS="trajectory.txt trajectory_1.txt trajectory_online.txt trajectory_online_1.txt keyframes.txt keyframes_1.txt map.ply"
for file in $RESULTS; do check "$file is there" test -s "$work/first/$file"; done
check "both cameras are in one map in the end" one_map "$work/first"
expect "the cameras lie right to one another" "$work/first" ate_rmse_joint "<= 0.02"
for camera in 0 1; do
  expect_camera "most of its frames are tracked" "$work/first" "$camera" tracked_online_percent ">= 50"
  expect_camera "nearly all have a pose in the end" "$work/first" "$camera" tracked_percent ">= 90"
  expect_camera "nothing is skipped" "$work/first" "$camera" frames_skipped "== 0"
done
expect "nothing is lost" "$work/first" records_lost "== 0"
expect "no keyframe is missing" "$work/first" keyframes_missing "== 0"
check "in one process it ends with 0" "$build/bin/dmslam-inprocess" "${sequences[@]}" --record "$work/one.lcmlog" --out "$work/one"
for file in $RESULTS; do
  check "$file of one process has the same bytes" cmp "$work/first/$file" "$work/one/$file"
done
for camera in 0 1; do
  check "the log has the poses of camera $camera" "$build/bin/dmslam-map" --log "$work/one.lcmlog" --camera-id "$camera" \
    --trajectory "$work/rebuilt.txt"
  suffix=_$camera
  check "of camera $camera they are those of the run" cmp "$work/one/trajectory${suffix#_0}.txt" "$work/rebuilt.txt"
done
check "the log plays in one process" "$build/bin/dmslam-inprocess" --log "$work/one.lcmlog" --seed 3 --out "$work/again"
for file in $RESULTS; do check "$file of the log has the same bytes" cmp "$work/one/$file" "$work/again/$file"; done
refused "holds no frames of camera 2 but of 0, 1" "$build/bin/dmslam-player" --cameras 3 --camera-id 2 --log "$work/one.lcmlog" \
  --to-log "$work/none.lcmlog"

# The second camera has half as many pixels, a lens, a wider view and half the rate.
cat >"$work/half.yaml" <<'EOF'
width: 320
height: 240
fx: 245
fy: 247
cx: 158
cy: 121
distortion: [-0.12, 0.02, 0.001, -0.001, 0]
fps: 15
EOF
check "its pictures are rendered" "$build/bin/dmslam-synth" --quiet --out "$work/half" --path halfsphere --frames 75 --fps 15 \
  --moving-share 0.15 --seed 1 --camera "$work/half.yaml"
models=(--sequence "$synthetic" --also "$work/half" --camera "$root/config/synthetic.yaml" --also-camera "$work/half.yaml" --seed 3)
check "two models: the run ends with 0" run "${models[@]}" --lockstep --out "$work/models"
no_orphans "the run with two models"
check "two models: both cameras are in one map in the end" one_map "$work/models"
expect "two models: the cameras lie right to one another" "$work/models" ate_rmse_joint "<= 0.02"
expect_camera "two models: nearly all have a pose in the end" "$work/models" 1 tracked_percent ">= 90"
check "two models, in one process: it ends with 0" "$build/bin/dmslam-inprocess" "${models[@]}" --out "$work/models_one"
for file in trajectory.txt trajectory_1.txt map.ply; do
  check "$file of two models has the same bytes in one process" cmp "$work/models/$file" "$work/models_one/$file"
done

# What does not fit is refused by name.
refused "camera-id 2: there are --cameras 2.*; give --cameras 3" "$build/bin/dmslam-frontend" --cameras 2 --camera-id 2
"$build/bin/dmslam-frontend" --cameras 2 --camera-id 2 2>/dev/null
check "64: that is the command line" test $? = 64
refused "nowhere: no such folder" run --sequence "$synthetic" --also /nowhere --camera "$root/config/synthetic.yaml" --out "$work/none"
sed -E 's/^( *f[xy][^:]*: *).*/\1400.0/' "$work/half.yaml" >"$work/narrow.yaml"
refused "half: its camera sees [0-9]+ % of what the one sees" "$build/bin/dmslam-inprocess" --sequence "$synthetic" \
  --also "$work/half" --camera "$root/config/synthetic.yaml" --also-camera "$work/narrow.yaml" --out "$work/none"
refused "also-camera: give one for each --also" "$build/bin/dmslam-inprocess" --sequence "$synthetic" --also "$second" \
  --camera "$root/config/synthetic.yaml" --also-camera "$work/half.yaml" --also-camera "$work/half.yaml" --out "$work/none"
bus=(--lcm-url "udpm://239.255.76.67:7679?ttl=0" --session 9 --cameras 2 --peers frontend)
sed -E 's/^( *fx[^:]*: *).*/\1400.0/' "$root/config/synthetic.yaml" >"$work/other.yaml"
"$build/bin/dmslam-player" "${bus[@]}" --sequence "$synthetic" --camera "$root/config/synthetic.yaml" >/dev/null 2>&1 &
players=$!
"$build/bin/dmslam-player" "${bus[@]}" --camera-id 1 --sequence "$second" --camera "$work/other.yaml" >/dev/null 2>&1 &
players+=" $!"
said=$(timeout 30 "$build/bin/dmslam-frontend" "${bus[@]}" --camera-id 1 2>&1)
status=$?
# shellcheck disable=SC2086
kill $players
wait
check "a frontend with another camera model ends with 2 (not $status)" test "$status" -eq 2
check "and says why" grep -q "camera 1 is another model than camera 0" <<<"$said"
finish
