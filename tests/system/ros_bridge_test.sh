# examples/ros_bridge between a ROS 2 camera (a stand-in: ros2_stand_in.py) and four processes; poses come back.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
[[ -x $build/bin/make_layouts ]] || { echo "SKIPPED: built without OpenCV's videoio"; exit $SKIPPED; }
find_python
[[ -n $python ]] || { echo "SKIPPED: there is no Python 3 with ctypes"; exit $SKIPPED; }

bus='udpm://239.255.76.67:29754?ttl=0&recv_buf_size=4194304'
cd "$root" || exit 1
check "a video is made" "$build/bin/make_layouts" "$synthetic" "$work/in" 100
check "its raw frames are a log" "$build/bin/dmslam-player" --quiet --video "$work/in/video.avi" --encoding raw \
  --camera config/synthetic.yaml --to-log "$work/camera.lcmlog"
check "Python types" lcm-gen -p --ppath="$work/types" lcmtypes/*.lcm

common=(--lcm-url "$bus" --peers frontend,mapper,loopcloser,collector --fresh-system --quiet)
for name in mapper loopcloser frontend; do timeout 300 "$build/bin/dmslam-$name" "${common[@]}" & done
timeout 300 "$build/bin/dmslam-collector" "${common[@]}" --out "$work/out" >"$work/table.txt" &
collector=$!
check "the bridge runs and ends" env PYTHONPATH="$work/types:examples/python" timeout 200 "$python" tests/system/ros2_stand_in.py \
  "$work/camera.lcmlog" "$work/poses.txt" 10 examples/ros_bridge/ros_bridge.py /camera/image_raw /camera/camera_info "$bus" \
  2>"$work/bridge.err"
check "the bridge has no complaint" test ! -s "$work/bridge.err"
cat "$work/bridge.err"
status=0
wait $collector || status=$?
((status == 0 || status == 6)) || failed "the collector ended with $status"
no_orphans "the end"
expect "all frames are counted" "$work/out" frames "== 100"
expect "frames were worked on" "$work/out" frames_processed ">= 40"
# A machine that is busy with something else skips frames, and may find no map in those that are left (6).
if ((status == 0)); then
  check "ROS gets poses" test "$(grep -cE ' dmslam_map$' "$work/poses.txt")" -ge 10
  # Each is the pose that the collector wrote as tracked, with the stamp that ROS gave the image.
  online=$work/out/trajectory_online.txt
  while read -r at _; do
    at=$(sed 's/000$//' <<<"$at") # files have six decimals, or nine where they are needed
    grep -q "^$at " "$online" || failed "the pose of $at is not in trajectory_online.txt"
  done <"$work/poses.txt"
fi
finish
