#!/usr/bin/env bash
# A picture of lcm-spy watching a run, without a screen. See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
usage() {
  cat <<'EOT'
Usage: scripts/spy_picture.sh --out FILE.png [--sequence DIR] [--camera FILE] [--build-dir DIR]

Starts lcm-spy on a virtual display (Xvfb), runs the system beside it at a tenth of the recorded rate, opens
DMSLAM_FRONTEND_POSE and a chart of its moving_share, waits for people to walk, and takes the picture. Fails where one of our channels cannot be
decoded or a window does not open. --sequence: default a rendered room with people who walk.
EOT
}
fail() { echo "spy_picture.sh: $*" >&2; exit 1; }
out="" sequence="" camera="" build=$top/build/release
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --out | --sequence | --camera | --build-dir)
      (($# > 1)) || fail "$1 needs a value (see --help)"
      name=${1#--}; printf -v "${name//-dir/}" %s "$2"; shift 2
      ;;
    *) fail "unknown option $1 (see --help)" ;;
  esac
done
[[ -n $out ]] || fail "--out is missing (see --help)"
for tool in Xvfb xdotool import; do
  command -v $tool >/dev/null || fail "$tool is missing; run scripts/setup.sh tools"
done

work=$(mktemp -d) pids=()
cleanup() {
  local p
  for p in "${pids[@]}"; do kill "$p" 2>/dev/null || true; done
  wait 2>/dev/null || true
  rm -rf -- "$work"
}
trap cleanup EXIT
if [[ -z $sequence ]]; then
  sequence=$work/sequence camera=$top/config/synthetic.yaml
  "$build/bin/dmslam-synth" --quiet --out "$sequence" --path xyz --frames 180 --samples 1 --moving-share 0.55 --actors 5 --behaviour stop-and-go --stand-first 2 --seed 5
fi

exec 5<>"$work/display"
Xvfb -displayfd 5 -screen 0 1700x960x24 -nolisten tcp 5>"$work/display" >"$work/xvfb.log" 2>&1 &
pids+=($!)
for ((i = 0; i < 200; ++i)); do [[ -s $work/display ]] && break; sleep 0.05; done
[[ -s $work/display ]] || fail "Xvfb did not start: $(cat "$work/xvfb.log")"
export DISPLAY=:$(tr -d '\n' <"$work/display")

port=$((20000 + RANDOM % 30000))
"$top/scripts/spy.sh" --port $port >"$work/spy.log" 2>&1 &
pids+=($!)
window() { xdotool search --onlyvisible --name "^$1\$" 2>/dev/null | tail -n 1 || true; }
wait_window() { # NAME TWENTIETHS: prints its id
  local i id
  for ((i = 0; i < $2; ++i)); do
    id=$(window "$1")
    if [[ -n $id ]]; then echo "$id"; return; fi
    sleep 0.05
  done
  return 1
}
spy=$(wait_window "LCM Spy" 1200) || fail "lcm-spy did not open its window: $(tail -n 3 "$work/spy.log")"
xdotool windowmove "$spy" 0 0 windowsize "$spy" 900 440

arguments=(--sequence "$sequence" --port $port --share-port --speed 0.1 --record --out "$work/run" --build-dir "$build")
[[ -z $camera ]] || arguments+=(--camera "$camera")
"$top/scripts/run.sh" "${arguments[@]}" >"$work/run.said" 2>&1 &
run=$!
pids+=("$run")
sleep 6
xdotool mousemove 400 427 click 1 # Clear: LCM's own self test at the start is no message of ours
sleep 3

# Double clicks on rows (sorted by channel, some come late) until the poses' window opens; others move out of sight.
pose=""
for row in 9 10 8 11 7 12 6 13 9 10 8 11 7 12 5 14 4 15; do
  xdotool mousemove 100 $((27 + 16 * row)) click --repeat 2 --delay 60 1
  for ((i = 0; i < 30; ++i)); do
    pose=$(window DMSLAM_FRONTEND_POSE)
    [[ -z $pose && -z $(window 'DMSLAM_.*') ]] || break
    sleep 0.05
  done
  [[ -z $pose ]] || break
  for other in $(xdotool search --onlyvisible --name '^DMSLAM_' 2>/dev/null || true); do xdotool windowunmap "$other"; done
done
[[ -n $pose ]] || fail "lcm-spy shows no DMSLAM_FRONTEND_POSE; the run said: $(tail -n 3 "$work/run.said")"
xdotool windowmove "$pose" 910 0 windowsize "$pose" 780 400
line=$(sed -nE 's/^ +[a-z0-9_]+ +([a-z0-9_]+);.*/\1/p' "$top/lcmtypes/dmslam_pose_t.lcm" | grep -n '^moving_share$' | cut -d: -f1)
chart=""
for ((attempt = 0; attempt < 10; ++attempt)); do # a curve needs two messages before it can be clicked
  sleep 1
  xdotool mousemove $((910 + 530)) $((18 + 15 * line)) click 1
  if chart=$(wait_window moving_share 20); then break; fi
done
[[ -n $chart ]] || fail "the chart of moving_share did not open"
xdotool windowmove "$chart" 0 445 windowsize "$chart" 900 510
xdotool mousemove 1300 700
sleep 19
mkdir -p "$(dirname "$out")"
import -window root "$out"
grep -qi "exception" "$work/spy.log" && fail "lcm-spy reported: $(grep -i exception "$work/spy.log" | head -n 1)"
wait "$run" || fail "the run failed: $(tail -n 1 "$work/run.said")"
# What the picture cannot prove: every channel that was heard has a type that spy knows.
jar tf "$("$top/scripts/spy.sh" --jar-only)" | sed -n 's|^dmslam/\(.*\)\.class$|\1|p' | sort >"$work/types"
"$build/bin/dmslam-map" --log "$work/run/run.lcmlog" --channels | awk '/^DMSLAM_/ { print $2 }' | sort -u >"$work/heard"
unknown=$(comm -13 "$work/types" "$work/heard")
[[ -z $unknown ]] || fail "channels carry what lcm-spy cannot decode: $unknown"
echo "$out: $(wc -l <"$work/heard") types on the bus, all decoded"
