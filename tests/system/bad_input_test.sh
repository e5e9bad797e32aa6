# What users get wrong: one clear line, an exit code that is not zero, and no process left.
source "$(dirname "$0")/lib.sh"
need_synthetic
camera=$root/config/synthetic.yaml

refused "multicast route.*ip route add" run --sequence "$synthetic" --camera "$camera" --out "$work/o"
last_line() { # of what COMMAND says: LCM says some of its own before
  local said status=0
  said=$("$@" 2>&1) || status=$?
  tail -n 1 <<<"$said"
  return "$status"
}
refused "multicast route.*dev DEVICE.*leads to the other hosts" last_line "$build/bin/dmslam-mapper" --session 1 \
  --lcm-url "udpm://239.255.76.67:7692?ttl=1" --link lan
multicast

refused "no such folder" run --sequence "$work/none" --out "$work/o"
refused "no-such-option" run --no-such-option
refused "--out is missing" run --sequence "$synthetic"
refused "whole number" run --sequence "$synthetic" --out "$work/o" --seed many
refused "dm, baseline or paper" run --sequence "$synthetic" --out "$work/o" --profile other
refused "speed" run --sequence "$synthetic" --camera "$camera" --out "$work/o" --speed fast

mkdir -p "$work/empty"
printf '# nothing\n' >"$work/empty/rgb.txt"
refused "rgb.txt" run --sequence "$work/empty" --camera "$camera" --out "$work/o"
printf '1.0 rgb/1.png\nsoon rgb/2.png\n' >"$work/empty/rgb.txt"
refused "rgb.txt:2" run --sequence "$work/empty" --camera "$camera" --out "$work/o"
printf '1.0 rgb/1.png\n' >"$work/empty/rgb.txt"
refused "rgb.txt|none" run --sequence "$work/empty" --camera "$camera" --out "$work/o"

mkdir -p "$work/broken/rgb"
printf '1.0 rgb/1.png\n2.0 rgb/2.png\n' >"$work/broken/rgb.txt"
printf 'this is no picture' | tee "$work/broken/rgb/1.png" >"$work/broken/rgb/2.png"
refused "1.png" run --sequence "$work/broken" --camera "$camera" --lockstep --out "$work/o"

refused "camera" run --sequence "$work/broken" --out "$work/o"
refused "none.yaml" run --sequence "$synthetic" --camera "$work/none.yaml" --out "$work/o"
sed '/^fx/d' "$camera" >"$work/no_fx.yaml"
refused "fx" run --sequence "$synthetic" --camera "$work/no_fx.yaml" --out "$work/o"
sed 's/^width:.*/width: 320/' "$camera" >"$work/small.yaml"
refused "320" run --sequence "$synthetic" --camera "$work/small.yaml" --lockstep --out "$work/o"

refused "no.such.key" run --sequence "$synthetic" --camera "$camera" --out "$work/o" --set no.such.key=1
refused "none.yaml" run --sequence "$synthetic" --camera "$camera" --out "$work/o" --config "$work/none.yaml"
refused "between 1024 and 65535" run --sequence "$synthetic" --camera "$camera" --out "$work/o" --port 80

# What an earlier run has left in the folder stays as it is, whatever is refused.
mkdir -p "$work/done/log" "$work/second/rgb"
for file in run.json summary.json trajectory.txt run.lcmlog log/player.log log/player1.log log/mapper.log log/table.txt; do
  echo "of the earlier run" >"$work/done/$file"
done
cp -r "$work/done" "$work/before"
sed -E 's/^( *f[xy][^:]*: *).*/\11200.0/' "$camera" >"$work/narrow.yaml"
sed -E 's/^( *fx[^:]*: *).*/\1400.0/' "$camera" >"$work/other.yaml"
cp "$synthetic/rgb.txt" "$work/second"
cp "$synthetic"/rgb/* "$work/second/rgb"
cp "$work/other.yaml" "$work/second/camera.yaml"
again() { # PATTERN ARGUMENTS...: is refused, and changes nothing
  refused "$1" run --sequence "$synthetic" --out "$work/done" "${@:2}"
  check "$*: what was in the folder is as it was" diff -r "$work/before" "$work/done"
}
two=(--camera "$camera" --also "$work/second" --also-camera)
again "second: its camera sees [0-9]+ % of what the one sees" "${two[@]}" "$work/narrow.yaml"
again "no_fx.yaml: .*fx" "${two[@]}" "$work/no_fx.yaml"
again "none.yaml: no such file; check --also-camera" "${two[@]}" "$work/none.yaml"
again "rgb/[^ ]*: is 640x480 pixels, but the camera file says 320x480" "${two[@]}" "$work/small.yaml"
again "also-camera is for recordings; /dev/video77" --camera "$camera" --also /dev/video77 --also-camera "$camera"
again "rgb.txt|none" --camera "$camera" --also "$work/empty"
cp "$camera" "$work/broken/camera.yaml"
refused "second: its camera has fx 400, that of .*broken has fx [0-9.]+; name the files of both" run --sequence "$work/broken" \
  --also "$work/second" --out "$work/done"
again "is 640x480 pixels, but the camera file says 320x480" --camera "$work/small.yaml"
again "no.such.key" --camera "$camera" --set no.such.key=1
for address in 127.0.0.1:99999 notanaddress; do
  again "http $address: write HOST:PORT" --camera "$camera" --viewer --http "$address"
done
mkdir "$work/adir"
again "save-map: $work/adir: is a folder" --camera "$camera" --save-map "$work/adir"
again "save-map: $work/done/log: is a folder" --camera "$camera" --save-map "$work/done/log"
refused "$work/adir: is a folder" "$build/bin/dmslam-inprocess" --sequence "$synthetic" --camera "$camera" --out "$work/o" \
  --save-map "$work/adir"
refused "$work/adir: is a folder" "$build/bin/dmslam-map" landmark "$work/none.map" --all --json "$work/adir"
again "speed 0: must be above zero" --camera "$camera" --speed 0
again "leaves no frame of 150" --camera "$camera" --start 150
again "--jump 5,500: there is no frame 500, the last of 150 frames is 149" --camera "$camera" --jump 5,500
again "--black-out 500,1: there is no frame 500, the last of 150 frames is 149" --camera "$camera" --black-out 500,1
again "black-out 10: write FROM,SECONDS" --camera "$camera" --black-out 10

refused "$work/adir: is a folder" "$build/bin/dmslam-map" list "$work/adir"

# Somebody else's socket on the port.
python3 -c '
import socket, sys
s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
s.bind(("", 23456))
print("bound", flush=True)
sys.stdin.read()' < <(sleep 60) >"$work/bound" &
holder=$!
for ((i = 0; i < 100; ++i)); do [[ -s $work/bound ]] && break; sleep 0.05; done
refused "port 23456 is taken" run --sequence "$synthetic" --camera "$camera" --out "$work/o" --port 23456
kill "$holder" 2>/dev/null
finish
