# A publisher of somebody else (examples/frame_publisher) takes the player's place; a listener in Python sees the poses.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast

bus='udpm://239.255.76.67:29753?ttl=0&recv_buf_size=4194304'
cd "$root" || exit 1
check "types are made" lcm-gen --cpp --cpp-hpath="$work/types" lcmtypes/dmslam_{camera_info,frame,end_of_sequence,sequence_done}_t.lcm
check "the example is built" c++ -std=c++17 -Wall -Wextra -isystem "$work/types" \
  examples/frame_publisher/frame_publisher.cc -llcm -lyaml-cpp -lz -o "$work/frame_publisher"
sed 's/^fps: .*/fps: 6/' config/synthetic.yaml >"$work/camera.yaml"

find_python
if [[ -n $python ]]; then
  check "Python types" lcm-gen -p --ppath="$work/python" lcmtypes/dmslam_pose_t.lcm
  PYTHONPATH=$work/python:examples/python timeout 200 "$python" examples/python/pose_printer.py "$bus" >"$work/poses.txt" 2>"$work/poses.err" &
  printer=$!
fi

common=(--lcm-url "$bus" --peers frontend,mapper,loopcloser,collector --fresh-system --quiet)
timeout 200 "$build/bin/dmslam-mapper" "${common[@]}" &
timeout 200 "$build/bin/dmslam-loopcloser" "${common[@]}" &
timeout 200 "$build/bin/dmslam-frontend" "${common[@]}" &
timeout 200 "$build/bin/dmslam-collector" "${common[@]}" --out "$work/out" >"$work/table.txt" &
collector=$!
images=("$synthetic"/rgb/*)
check "the frontend hears the end" timeout 120 "$work/frame_publisher" "$bus" "$work/camera.yaml" "${images[@]:0:60}"
status=0
wait $collector || status=$?
# At a fifth of the speed there may be too little motion for a map (6); whether frames and poses travel is what counts here.
((status == 0 || status == 6)) || failed "the collector ended with $status"
no_orphans "the end"
expect "all frames are counted" "$work/out" frames "== 60"
expect "frames were worked on" "$work/out" frames_processed ">= 20"
expect "nothing is lost" "$work/out" records_lost "== 0"
if [[ -n $python ]]; then
  kill "$printer" 2>/dev/null
  check "Python sees frames" test "$(grep -cE '^[0-9]+\.[0-9]{9} frame [0-9]+: [a-z]' "$work/poses.txt")" -ge 20
  check "Python has no complaint" test ! -s "$work/poses.err"
fi
finish
