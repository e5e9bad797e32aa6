#!/usr/bin/env bash
# Camera files of other programs become ours; what cannot be converted is refused by the field's name.
source "$(dirname "$0")/expect.sh"
root=${DMSLAM_SOURCE_DIR:?set by ctest}
convert=$root/scripts/convert_camera.sh
cd "$work" || exit 1

orb() { # lines to add: settings as ORB-SLAM2's
  printf '%s\n' '%YAML:1.0' '# a camera' 'Camera.fx: 517.3' 'Camera.fy: 516.5' 'Camera.cx: 318.6' 'Camera.cy: 255.3' '' \
    'Camera.k1: 0.2624' 'Camera.k2: -0.9531' 'Camera.p1: -0.0054' 'Camera.p2: 0.0026' 'Camera.k3: 1.1633' 'Camera.fps: 25.0' "$@"
}
freiburg1='fx: 517.3.fy: 516.5.cx: 318.6.cy: 255.3.distortion: \[0.2624, -0.9531, -0.0054, 0.0026, 1.1633\]'
gives() { # DESCRIPTION PATTERN COMMAND...: what it prints matches, all in one line
  local description=$1 pattern=$2 said
  shift 2
  said=$("$@" 2>&1 | tr '\n' ' ')
  grep -qE "$pattern" <<<"$said" || { echo "FAILED: $description: $said"; failures=$((failures + 1)); }
}
orb >orb2.yaml
gives "ORB-SLAM2" "width: 640 height: 480 $freiburg1.*fps: 25.0" "$convert" --size 640x480 orb2.yaml
expect fail "orb2.yaml: does not say how large.*--size" "$convert" orb2.yaml
orb 'Camera.type: "PinHole"' 'Camera.width: 640' 'Camera.height: 480' >orb3.yaml
gives "ORB-SLAM3" "width: 640 height: 480 $freiburg1" "$convert" orb3.yaml
orb 'Camera.type: "KannalaBrandt8"' >fisheye.yaml
expect fail "field 'Camera.k4' is missing" "$convert" fisheye.yaml
printf '%s\n' 'Camera.k4: 0.02' 'Camera.width: 640' 'Camera.height: 480' >>fisheye.yaml
gives "ORB-SLAM3, fisheye" "model: fisheye width: 640 .*distortion: \[0.2624, -0.9531, 1.1633, 0.02\]  # k1, k2, k3, k4" \
  "$convert" fisheye.yaml
sed -i 's/KannalaBrandt8/Mei/' fisheye.yaml
expect fail "'Camera.type' is 'Mei'" "$convert" fisheye.yaml
orb | grep -v Camera.fy >short.yaml
expect fail "short.yaml: field 'Camera.fy' is missing" "$convert" --size 640x480 short.yaml
orb | sed 's/fy: .*/fy: wide/' >word.yaml
expect fail "'Camera.fy' is 'wide', which is not a number" "$convert" --size 640x480 word.yaml

echo "517.3 516.5 318.6 255.3 0.2624 -0.9531 -0.0054 0.0026 1.1633" >tum.txt
gives "TUM's table" "$freiburg1.*fps: 30" "$convert" --size 640x480 tum.txt
printf '0.5 0.7 0.49 0.5 0.93\n1280 1024\n' >mono.txt
expect fail "fisheye" "$convert" mono.txt
printf 'KannalaBrandt 380 380 320 240 0.01 0.002 -0.003 0.0004\n640 480\n' >fisheye.txt
gives "a line of a fisheye lens" "model: fisheye width: 640 height: 480 fx: 380 .*\[0.01, 0.002, -0.003, 0.0004\]" "$convert" fisheye.txt
printf '0.5 0.7 0.49 0.5 0\n1280 1024\n' >mono.txt
gives "TUM monocular, rectified" "width: 1280 height: 1024 fx: 640 fy: 716.8 cx: 626.7 cy: 511.5" "$convert" mono.txt

printf '%s\n' 'sensor_type: camera' 'T_BS:' '  rows: 4' '  data: [0.0, 1.0,' '    2.0, 3.0]' 'rate_hz: 20' \
  'resolution: [752, 480]' 'camera_model: pinhole' 'intrinsics: [458.6, 457.2, 367.2, 248.3] #fu, fv, cu, cv' \
  'distortion_model: radial-tangential' 'distortion_coefficients: [-0.28, 0.07, 0.0001, 1.7e-05]' >sensor.yaml
gives "EuRoC" "width: 752 .*fx: 458.6 fy: 457.2 cx: 367.2 cy: 248.3 distortion: \[-0.28, 0.07, 0.0001, 1.7e-05, 0\].*fps: 20" \
  "$convert" sensor.yaml
sed -i 's/radial-tangential/equidistant/' sensor.yaml
gives "EuRoC, fisheye" "model: fisheye .*distortion: \[-0.28, 0.07, 0.0001, 1.7e-05\]" "$convert" sensor.yaml
sed -i 's/, 1.7e-05\]/]/' sensor.yaml
expect fail "'distortion_coefficients' has 3 numbers; a fisheye lens has four" "$convert" sensor.yaml
sed -i 's/equidistant/omni/' sensor.yaml
expect fail "'distortion_model' is 'omni'" "$convert" sensor.yaml

printf '%s\n' '%YAML:1.0' '---' 'image_width: 640' 'image_height: 480' 'camera_matrix: !!opencv-matrix' '   rows: 3' '   cols: 3' \
  '   dt: d' '   data: [ 5.3e+02, 0., 3.1e+02, 0., 5.4e+02,' '      2.3e+02, 0., 0., 1. ]' \
  'distortion_coefficients: !!opencv-matrix' '   rows: 5' '   data: [ -0.28, 0.02, 0.001, -1.4e-04, 0.16 ]' >opencv.yaml
gives "OpenCV, YAML" "width: 640 height: 480 fx: 5.3e\+02 fy: 5.4e\+02 cx: 3.1e\+02 cy: 2.3e\+02 distortion: \[-0.28, 0.02, 0.001, -1.4e-04, 0.16\]" \
  "$convert" opencv.yaml
sed -i 's/0.16 \]/0.16, 0.4, 0.1, 0.2 ]/' opencv.yaml
expect fail "'distortion_coefficients' has more than five" "$convert" opencv.yaml

printf '%s\n' '<?xml version="1.0"?>' '<opencv_storage>' '<cameraResolution>' '  640 480</cameraResolution>' \
  '<cameraMatrix type_id="opencv-matrix">' '  <rows>3</rows>' '  <dt>d</dt>' '  <data>' '    520. 0. 320. 0. 521.' \
  '    240. 0. 0. 1.</data></cameraMatrix>' '<dist_coeffs type_id="opencv-matrix">' '  <data>' \
  '    0.1 -0.2 0. 0. 0.</data></dist_coeffs>' '</opencv_storage>' >opencv.xml
gives "OpenCV, XML" "width: 640 height: 480 fx: 520. fy: 521. cx: 320. cy: 240. distortion: \[0.1, -0.2, 0., 0., 0.\]" "$convert" opencv.xml

expect fail "nothing.yaml: cannot be read" "$convert" nothing.yaml
echo "hello world" >other.txt
expect fail "other.txt: is no camera file" "$convert" other.txt
: >empty.txt
expect fail "empty.txt: is empty" "$convert" empty.txt
expect fail "640:480: write WIDTHxHEIGHT" "$convert" --size 640:480 tum.txt
finish
