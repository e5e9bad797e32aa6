# The same frames as TUM folder, EuRoC layout, numbered images and lossless video: the same trajectory, byte for byte.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast

[[ -x $build/bin/make_layouts ]] || { echo "SKIPPED: built without OpenCV's videoio"; exit $SKIPPED; }
check "the layouts are made" "$build/bin/make_layouts" "$synthetic" "$work/in" 100
common=(--camera "$root/config/synthetic.yaml" --seed 2 --set loop.enabled=off)
one() { # NAME OPTIONS...
  local name=$1
  shift
  check "$name is played" "$build/bin/dmslam-inprocess" "${common[@]}" "$@" --out "$work/$name"
}
one tum --sequence "$work/in/tum"
one euroc --sequence "$work/in/euroc"
one numbered --sequence "$work/in/numbered" --fps 30
one video --video "$work/in/video.avi" --encoding png
check "most frames have a pose" test "$(grep -vc '^#' "$work/tum/trajectory.txt")" -ge 50
for name in euroc numbered video; do
  for file in trajectory.txt trajectory_online.txt keyframes.txt map.ply; do
    check "$file of $name is that of the TUM folder" cmp "$work/tum/$file" "$work/$name/$file"
  done
done

# The real player reads the video as well, with the same option.
check "four processes play the video" run --video "$work/in/video.avi" --encoding png "${common[@]:0:4}" --no-loop \
  --lockstep --out "$work/processes"
check "four processes give the same trajectory" cmp "$work/tum/trajectory.txt" "$work/processes/trajectory.txt"
finish
