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
