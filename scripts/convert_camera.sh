#!/usr/bin/env bash
# Camera files of others to ours (docs/camera.md). See --help.
set -euo pipefail
me=scripts/convert_camera.sh
case "$(basename "$0")" in dmslam-*) me=$(basename "$0") ;; esac
usage() {
  cat <<EOF
Usage: $me [--size WIDTHxHEIGHT] [--fps X] FILE >camera.yaml

Converts the camera file of another program: the result is printed. What FILE is, is seen from its content: settings of
ORB-SLAM2 or ORB-SLAM3; a calibration by OpenCV (YAML or XML) or by ROS; sensor.yaml of a EuRoC sequence; or one line of
numbers as TUM publishes them: fx fy cx cy, or these and k1 k2 p1 p2 k3. A fisheye lens of four coefficients (equidistant,
KannalaBrandt8, OpenCV's fisheye module) becomes the model fisheye; other wide models are refused by name.

  --size WxH    size of the images in pixels, where the file does not say it
  --fps X       frames per second, where the file does not say it
EOF
}
fail() { echo "$(basename "$me"): $*" >&2; exit 1; }
file="" size="" fps=""
while [ $# -gt 0 ]; do
  case "$1" in
    --size | --fps) [ $# -ge 2 ] || fail "$1 needs a value (see --help)"; printf -v "${1#--}" %s "$2"; shift 2 ;;
    -h | --help) usage; exit 0 ;;
    -*) fail "unknown option $1 (see --help)" ;;
    *) [ -z "$file" ] || fail "one file at a time (see --help)"; file=$1; shift ;;
  esac
done
[ -n "$file" ] || fail "which file? (see --help)"
{ [ -r "$file" ] && [ -f "$file" ]; } || fail "$file: cannot be read; check the path"
[ -z "$size" ] || [[ $size =~ ^[0-9]+x[0-9]+$ ]] || fail "--size $size: write WIDTHxHEIGHT, as 640x480"
text=$(tr -d '\r' <"$file" | sed -E 's/[[:space:]]+#.*//; /^#/d')
number='^[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?$'

# The value of the first of these fields that is there, in YAML or XML; nothing where none is.
field() {
  local name value
  for name in "$@"; do
    value=$(sed -nE "s|^ *$name *: *[\"']?([^\"']*[^\"' ])[\"']? *$|\1|p; s|.*<$name>[\"']?([^<\"]*)[\"']?</$name>.*|\1|p" <<<"$text")
    [ -z "$value" ] || { echo "${value%%$'\n'*}"; return; }
  done
}
# The numbers of the first of these matrices or lists that is there, in one line.
list() {
  local name values
  for name in "$@"; do
    values=$(awk -v name="$name" '
      !on && ($0 ~ "^ *" name " *:" || $0 ~ "<" name "[ >]") { on = 1; plain = $0 ~ "<" name ">"; if (plain) sub("^.*<" name ">", "") }
      on && !data && (plain || /\[|<data>/) { data = 1; if (!plain) sub(/^.*(\[|<data>)/, "") }
      data && !done {
        part = $0
        done = sub(/(\]|<\/).*$/, "", part)
        gsub(/,/, " ", part)
        all = all " " part
      }
      END { gsub(/^ +| +$/, "", all); gsub(/ +/, " ", all); print all }' <<<"$text")
    [ -z "$values" ] || { echo "$values"; return; }
  done
}
require() { # NAME VALUE: a number, or the file is refused by the field's name
  [ -n "$2" ] || fail "$file: field '$1' is missing; add it"
  [[ $2 =~ $number ]] || fail "$file: field '$1' is '$2', which is not a number; write one"
}
refuse_model() { # FIELD VALUE
  fail "$file: field '$1' is '$2', a model that is not supported; undistort the images to a pinhole camera first (docs/camera.md)"
}
holds() { awk "BEGIN { exit !($1) }" </dev/null; }

fx="" fy="" cx="" cy="" model=pinhole distortion=(0 0 0 0 0) width="" height=""
use_fisheye() { # FIELD VALUES...: four
  local name=$1 value
  shift
  [ $# = 4 ] || fail "$file: field '$name' has $# numbers; a fisheye lens has four: k1, k2, k3, k4"
  for value in "$@"; do require "$name" "$value"; done
  model=fisheye distortion=("$@")
}
use_distortion() { # FIELD VALUES...: up to five; more only where they are zero
  local name=$1 i=0 value
  shift
  for value in "$@"; do
    require "$name" "$value"
    if [ $i -lt 5 ]; then
      distortion[i]=$value
    elif ! holds "$value == 0"; then
      fail "$file: field '$name' has more than five coefficients (a rational or thin prism model); calibrate with five"
    fi
    i=$((i + 1))
  done
}
read_orb_slam() {
  local type name value i=0 prefix=Camera fisheye=() names="k1 k2 p1 p2 k3"
  [ -z "$(field Camera1.fx)" ] || prefix=Camera1
  type=$(field Camera.type)
  case "${type,,}" in "" | pinhole | rectified) ;; kannalabrandt8) names="" ;; *) refuse_model Camera.type "$type" ;; esac
  for name in fx fy cx cy; do
    value=$(field "$prefix.$name")
    require "$prefix.$name" "$value"
    printf -v "$name" %s "$value"
  done
  if [ -z "$names" ]; then
    for name in k1 k2 k3 k4; do
      value=$(field "$prefix.$name")
      require "$prefix.$name" "$value"
      fisheye+=("$value")
    done
    use_fisheye "$prefix.k1 to k4" "${fisheye[@]}"
  fi
  for name in $names; do
    value=$(field "$prefix.$name")
    [ -z "$value" ] || { require "$prefix.$name" "$value"; distortion[i]=$value; }
    i=$((i + 1))
  done
  width=$(field Camera.width) height=$(field Camera.height)
  [ -n "$fps" ] || fps=$(field Camera.fps)
}
read_matrix() { # OpenCV's tools and ROS: a 3x3 matrix and a list
  local lens k d resolution use=use_distortion
  lens=$(field distortion_model camera_model)
  case "${lens,,}" in
    "" | plumb_bob | pinhole | radtan | rational_polynomial) ;;
    equidistant | fisheye) use=use_fisheye ;;
    *) refuse_model distortion_model "$lens" ;;
  esac
  lens=$(field fisheye_model)
  [ -z "$lens" ] || [ "$lens" = 0 ] || use=use_fisheye
  read -ra k <<<"$(list camera_matrix cameraMatrix)"
  [ ${#k[@]} = 9 ] || fail "$file: field 'camera_matrix' has ${#k[@]} numbers; nine are wanted"
  fx=${k[0]} cx=${k[2]} fy=${k[4]} cy=${k[5]}
  read -ra d <<<"$(list distortion_coefficients dist_coeffs)"
  $use distortion_coefficients "${d[@]}"
  width=$(field image_width) height=$(field image_height)
  read -ra resolution <<<"$(list cameraResolution)"
  [ ${#resolution[@]} != 2 ] || width=${resolution[0]} height=${resolution[1]}
}
read_euroc() {
  local lens k d resolution use=use_distortion
  lens=$(field camera_model)
  case "${lens,,}" in "" | pinhole) ;; *) refuse_model camera_model "$lens" ;; esac
  lens=$(field distortion_model)
  case "${lens,,}" in
    "" | radial-tangential | radtan | plumb_bob) ;;
    equidistant) use=use_fisheye ;;
    *) refuse_model distortion_model "$lens" ;;
  esac
  read -ra k <<<"$(list intrinsics)"
  [ ${#k[@]} = 4 ] || fail "$file: field 'intrinsics' has ${#k[@]} numbers; four are wanted: fx, fy, cx, cy"
  fx=${k[0]} fy=${k[1]} cx=${k[2]} cy=${k[3]}
  read -ra d <<<"$(list distortion_coefficients distortion_coeffs)"
  $use distortion_coefficients "${d[@]}"
  read -ra resolution <<<"$(list resolution)"
  width=${resolution[0]:-} height=${resolution[1]:-}
  [ -n "$fps" ] || fps=$(field rate_hz)
}
read_numbers() { # the benchmark's table, or camera.txt of TUM's monocular sequences
  local first value lens="" w h
  read -ra first <<<"$text"
  [ ${#first[@]} -gt 0 ] || fail "$file: is empty"
  [[ ${first[0]} =~ $number ]] || { lens=${first[0]}; first=("${first[@]:1}"); }
  case "${lens,,}" in
    "" | pinhole | radtan | equidistant | kannalabrandt) ;;
    fov) refuse_model model "$lens" ;;
    *) fail "$file: is no camera file that is known (see --help)" ;;
  esac
  case ${#first[@]} in
    4 | 5 | 8 | 9) ;;
    *) fail "$file: has ${#first[@]} numbers in its first line; 4, 8 or 9 are wanted: fx fy cx cy k1 k2 p1 p2 k3" ;;
  esac
  for value in "${first[@]}"; do require "line 1" "$value"; done
  [ ${#first[@]} != 5 ] || holds "${first[4]} == 0" || refuse_model "line 1" "FOV, a fisheye lens"
  fx=${first[0]} fy=${first[1]} cx=${first[2]} cy=${first[3]}
  case "${lens,,}" in
    equidistant | kannalabrandt) use_fisheye "line 1" "${first[@]:4}" ;;
    *) [ ${#first[@]} = 5 ] || use_distortion "line 1" "${first[@]:4}" ;;
  esac
  read -r width height _ <<<"$(sed -n 2p <<<"$text")" || true
  holds "$fx < 10" || return 0
  w=$width h=$height # the numbers are shares of the image's size, from its corner
  [ -z "$size" ] || w=${size%x*} h=${size#*x}
  [ -n "$w" ] || fail "$file: its focal lengths are shares of the image's size; give that with --size WIDTHxHEIGHT"
  fx=$(awk "BEGIN { print $fx * $w }") cx=$(awk "BEGIN { print $cx * $w - 0.5 }")
  fy=$(awk "BEGIN { print $fy * $h }") cy=$(awk "BEGIN { print $cy * $h - 0.5 }")
}

if grep -qE '^ *Camera1?\.' <<<"$text"; then
  read_orb_slam
elif grep -qiE 'camera_?matrix' <<<"$text"; then
  read_matrix
elif grep -qE '^ *intrinsics *:' <<<"$text"; then
  read_euroc
else
  read_numbers
fi
[ -z "$size" ] || width=${size%x*} height=${size#*x}
[[ $width =~ ^[0-9]+$ && $height =~ ^[0-9]+$ ]] ||
  fail "$file: does not say how large the images are; give --size WIDTHxHEIGHT"
for name in fx fy cx cy; do require "$name" "${!name}"; done
fps=${fps:-30}
require fps "$fps"
order="k1, k2, p1, p2, k3"
[ $model = pinhole ] || order="k1, k2, k3, k4"
printf -v coefficients ', %s' "${distortion[@]}"
cat <<EOF
# Converted from $(basename "$file").
model: $model
width: $width
height: $height
fx: $fx
fy: $fy
cx: $cx
cy: $cy
distortion: [${coefficients#, }]  # $order
fps: $fps
EOF
