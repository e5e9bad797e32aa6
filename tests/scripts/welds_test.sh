#!/usr/bin/env bash
# scripts/welds_table.py on runs that are made up: which it calls good.
# shellcheck source-path=SCRIPTDIR source=expect.sh
source "$(dirname "$0")/expect.sh"
table() { expect "$1" "$2" python3 "$DMSLAM_SOURCE_DIR/scripts/welds_table.py" "$work/sequences" "$work/results"; }

# a_run NAME [SHIFT_OF_ONE [SHIFT_OF_CAMERA_1 [FRAMES_OF_CAMERA_1 [MATCHED_FRAME [SEEN_FROM_IT]]]]]: two cameras on winding ways of some 12 m each,
# one behind the other. Frame 50 of camera 0 is told so far aside [m], all of camera 1, and so many of it have poses; frame 0 of
# camera 1 is joined with that frame of camera 0, from which it is said to be there (x, y, z in units of the map, half a metre
# each). 0.3 % of the path are 0.07 m.
a_run() {
  local folder=$work/results/$1 camera
  mkdir -p "$folder"
  for camera in 0 1; do
    mkdir -p "$work/sequences/$1_$camera"
    awk -v camera=$camera -v one="${2:-0}" -v all="${3:-0}" -v count="${4:-100}" -v folder="$folder" \
      -v truth="$work/sequences/$1_$camera" 'BEGIN {
        told = folder "/trajectory" (camera ? "_1" : "") ".txt"
        for (i = 0; i < 100; ++i) {
          stamp = sprintf("%.6f", 5 + i / 15); x = 10 * camera + i / 9.9; y = sin(x); z = cos(2 * x) / 4
          print stamp, x, y, z, 0, 0, 0, 1 > (truth "/groundtruth.txt")
          print stamp, i ".png" > (truth "/rgb.txt")
          aside = camera ? all : i == 50 ? one : 0
          if (camera == 0 || i < count) print stamp, 2 * x, 2 * y, 2 * (z + aside), 0, 0, 0, 1 > told
        } }'
  done
  cat >"$folder/summary.json" <<EOJ
{"cameras": [{"other_maps": []}, {"other_maps": []}], "loop_closing": {"corrections": [
  {"kind": "loop", "camera": 1, "frame": 0, "matched_camera": 0, "matched_frame": ${5:-99}, "T_matched_keyframe": [${6:-0, 0, 0}, ${7:-0, 0, 0, 1}]}]}}
EOJ
}

a_run precise 0 0 100
table 0 '^\| precise \| 2 of 2 \| 100 100 \| none \| 1 / 0 \| 0\.0000 \| 0\.0000 0\.0000 \| 0\.0[0-9]* \| 0\.000 \| good \|'
a_run one_aside 0.4
table 0 '^\| one_aside .*\| good \|'
a_run one_far_aside 6
table 1 '^\| one_far_aside .*\| OFF \|'
grep -q '3 runs: 2 good, 0 with a false weld, 0 with a missed one, 1 with poses that are off' <<<"$output" || {
  echo "FAILED: the count"; failures=$((failures + 1))
}
rm -r "$work/results/one_far_aside"
a_run camera_aside 0 0.6
table 1 '^\| camera_aside .*\| OFF \|'
rm -r "$work/results/camera_aside"
a_run left_out 0 0 20
table 1 '^\| left_out \| 1 of 2 .*\| missed \|'
mv "$work/results/left_out" "$work/results/rooms_apart"
for camera in 0 1; do mv "$work/sequences/left_out_$camera" "$work/sequences/rooms_apart_$camera"; done
table 0 '^\| rooms_apart \| 1 of 2 .*\| good \|'
a_run false_weld 0 0 100 10
table 1 '^\| false_weld .*\| 1 / 1 .*\| FALSE \|'
rm -r "$work/results/false_weld"
# Frame 50 is at 500/99 on its way, five metres before frame 0 of camera 1.
there=$(awk 'BEGIN { x = 50 / 9.9; print 2 * (10 - x) ", " 2 * (sin(10) - sin(x)) ", " 2 * (cos(20) - cos(2 * x)) / 4 }')
a_run seen_from_afar 0 0 100 50 "$there"
table 0 '^\| seen_from_afar .*\| 1 / 0 .*\| good \|'
# Told in a map whose unit was a metre and a half, and which became part of one with half a metre afterwards.
in_thirds=$(awk -v there="$there" 'BEGIN { split(there, p, ", "); print p[1] / 3 ", " p[2] / 3 ", " p[3] / 3 }')
carried_on() { # NAME SCALE: the same weld, and a later one that carries its map into another, so many times as large
  a_run "$1" 0 0 100 50 "$in_thirds"
  cat >"$work/results/$1/summary.json" <<EOJ
{"cameras": [{"other_maps": []}, {"other_maps": []}], "loop_closing": {"corrections": [
  {"kind": "loop", "camera": 1, "frame": 0, "matched_camera": 0, "matched_frame": 50, "T_matched_keyframe": [$in_thirds, 0, 0, 0, 1],
   "note": "it moves by 0.8 (0.0 sigma) and scales by 0.6; map 3 becomes part of map 2"},
  {"kind": "loop", "camera": 1, "frame": 9, "matched_camera": 1, "matched_frame": 9, "T_matched_keyframe": [0, 0, 0, 0, 0, 0, 1],
   "note": "it moves by 0.8 (0.0 sigma) and scales by $2; map 2 becomes part of map 1"}]}}
EOJ
}
carried_on told_in_another_unit 3.0
table 0 '^\| told_in_another_unit .*\| 2 / 0 .*\| good \|'
carried_on told_in_the_same_unit 1.0
table 1 '^\| told_in_the_same_unit .*\| 2 / 1 .*\| FALSE \|'
rm -r "$work/results/told_in_the_same_unit"
a_run turned_weld 0 0 100 50 "$there" '0, 0, 0.26, 0.966'
table 1 '^\| turned_weld .*\| 1 / 1 .*\| FALSE \|'
finish
