# Two cameras in one room, for the tests of several: `sequences` says to a program what they see, and in what model.
second=$build/second # rendered before, see CMakeLists.txt
[[ -s $second/rgb.txt ]] || { echo "FAILED: $second was not rendered"; exit 1; }
sequences=(--sequence "$synthetic" --also "$second" --camera "$root/config/synthetic.yaml" --seed 3)

camera_field() { # FOLDER CAMERA KEY
  sed -n '/"cameras": \[/,$p' "$1/summary.json" | sed -n "/\"camera\": $2,/,\$p" | sed -nE "s/^ *\"$3\": *([^,]*),?$/\1/p" | head -n 1
}
expect_camera() { # DESCRIPTION FOLDER CAMERA KEY RELATION
  local value
  value=$(camera_field "$2" "$3" "$4")
  if [[ ! $value =~ ^-?[0-9.e+-]+$ ]] || ! holds "$value $5"; then failed "$1: $4 of camera $3 is ${value:-absent}, wanted $5"; fi
}
one_map() { # FOLDER: both cameras are in it, and there is no other one
  [[ $(camera_field "$1" 0 map) == $(camera_field "$1" 1 map) ]] && [[ $(camera_field "$1" 0 other_maps) == "[]" ]] &&
    [[ $(camera_field "$1" 1 other_maps) == "[]" ]]
}
