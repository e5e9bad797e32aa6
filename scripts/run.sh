#!/usr/bin/env bash
# Plays a sequence through the real processes and writes the results. See --help.
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
me=run.sh installed=0 build=""
case "$(basename "$0")" in dmslam-*) me=$(basename "$0") installed=1 build=$top ;; esac  # beside the programs
usage() {
  cat <<EOF
Usage: $([ "$installed" = 1 ] || echo scripts/)$me --sequence DIR | --log FILE | --replay FILE  --out DIR [options]

Plays a sequence (TUM RGB-D folder, EuRoC folder, numbered images, video) through player, frontend, mapper and loop
closer, four processes on a private LCM port, and writes into the --out folder: trajectory.txt (final, TUM format),
trajectory_online.txt, keyframes.txt, map.ply, trajectory.png, summary.json, and the processes' logs.

  --video FILE        instead of --sequence: a video, a camera (/dev/videoN), or the address of a camera's stream
  --fps X             rate of numbered images, of videos that state none, and asked of a camera (default: camera file)
  --encoding NAME     how frames of videos and cameras travel: jpeg (default), png or raw, both without loss
  --log FILE          instead of --sequence: the frames of a log of lcm-logger, by our player (any mode)
  --replay FILE       instead of --sequence: the camera channels of such a log, by the real lcm-logplayer, in real time
                      (--start, --frames, --black-out, --jump, --camera and --prefix: of a copy of them)
  --map FILE          begin in a saved map (or the map of a log), and go on with it
  --localize          with --map: find the camera in it, and leave the map as it is
  --save-map FILE     save the map at the end
  --camera FILE       camera file (YAML); found by itself for TUM freiburg1/2/3
  --lockstep          wait for every frame: the same input and seed give the same bytes
  --speed X           real time at X times the recorded rate (default 1)
  --seed N            seed of everything random (default 1)
  --start I           first frame
  --frames N          at most so many frames
  --config FILE       settings (YAML)
  --set KEY=VALUE     one setting; may be repeated (docs/configuration.md)
  --profile NAME      dm (default) or baseline: plain RANSAC start, no mutual exclusion, no motion belief
  --no-loop           do not close loops
  --pictures N        draw the features of every Nth frame into DIR/pictures
  --viewer            show it live in a browser; the address is printed, and opened where there is a desktop
  --http HOST:PORT    where the viewer serves (default 127.0.0.1:8080, or any port that is free)
  --record            record everything with lcm-logger into DIR/run.lcmlog
  --black-out F,S     black frames from frame F on for S seconds; may be repeated
  --jump F,T          after frame F go on with frame T; may be repeated
  --port N            UDP port (default: a free one)
  --share-port        others may be on that port already: lcm-spy, a logger, a system with another --prefix
  --prefix NAME       put before every channel: separates systems on one port
  --receive-buffer N  bytes that the kernel is asked to hold for each process (default 4194304)
  --no-restart        a process that dies ends the run (default: it is started again, and goes on where it was)
  --build-dir DIR     where the programs are (default: build/release, built first where needed)
EOF
}
fail() { echo "$me: $*" >&2; exit 1; }

sequence="" log_file="" replay="" speed=1 map="" localize=0 mapper=() out="" camera="" lockstep=0 seed=1 profile="" pictures=0 record=0 port="" share_port=0 receive_buffer=4194304 restart=1
viewer=0 http=()
player=() common=() changed=() prefix=""
need() { [ $# -ge 2 ] || fail "$1 needs a value (see --help)"; }
while [ $# -gt 0 ]; do
  case "$1" in
    --sequence | --video) need "$@"; sequence=$2; shift 2 ;;
    --log) need "$@"; log_file=$2; shift 2 ;;
    --replay) need "$@"; replay=$2; shift 2 ;;
    --map) need "$@"; map=$2; shift 2 ;;
    --localize) localize=1; shift ;;
    --save-map) need "$@"; mapper+=(--save-map "$2"); shift 2 ;;
    --out) need "$@"; out=$2; shift 2 ;;
    --camera) need "$@"; camera=$2; shift 2 ;;
    --lockstep) lockstep=1; shift ;;
    --speed) need "$@"; speed=$2; player+=(--speed "$2"); shift 2 ;;
    --seed) need "$@"; seed=$2; shift 2 ;;
    --start | --frames | --black-out | --jump) need "$@"; player+=("$1" "$2"); changed+=("$1" "$2"); shift 2 ;;
    --fps | --encoding) need "$@"; player+=("$1" "$2"); shift 2 ;;
    --config) need "$@"; common+=(--config "$2"); shift 2 ;;
    --set) need "$@"; common+=(--set "$2"); shift 2 ;;
    --profile) need "$@"; profile=$2; shift 2 ;;
    --no-loop) common+=(--set loop.enabled=off); shift ;;
    --pictures) need "$@"; pictures=$2; shift 2 ;;
    --record) record=1; shift ;;
    --viewer) viewer=1; shift ;;
    --http) need "$@"; http=(--http "$2") viewer=1; shift 2 ;;
    --port) need "$@"; port=$2; shift 2 ;;
    --share-port) share_port=1; shift ;;
    --prefix) need "$@"; prefix=$2; common+=(--prefix "$2"); shift 2 ;;
    --receive-buffer) need "$@"; receive_buffer=$2; shift 2 ;;
    --no-restart) restart=0; shift ;;
    --build-dir) need "$@"; build=$2; shift 2 ;;
    -h | --help) usage; exit 0 ;;
    *) fail "unknown option $1 (see --help)" ;;
  esac
done
case "${sequence:+s}${log_file:+l}${replay:+r}" in
  s | l | r) ;;
  "") fail "--sequence is missing (see --help)" ;;
  *) fail "give one of --sequence, --log and --replay" ;;
esac
[ -n "$out" ] || fail "--out is missing (see --help)"
is_number() { [[ "$2" =~ ^[0-9]+$ ]] || fail "$1 $2: write a whole number"; }
is_number --seed "$seed"
is_number --pictures "$pictures"
is_number --receive-buffer "$receive_buffer"
[ -z "$sequence" ] || [ -e "$sequence" ] || [[ $sequence == *://* || $sequence == /dev/* ]] || fail "$sequence: no such folder or file; check --sequence"
[ -z "$log_file" ] || [ -f "$log_file" ] || fail "$log_file: no such file; check --log"
[ -z "$replay" ] || [ -f "$replay" ] || fail "$replay: no such file; check --replay"
[ -z "$map" ] || [ -f "$map" ] || fail "$map: no such file; check --map"
[ "$localize" = 0 ] || [ -n "$map" ] || fail "--localize needs a map: give it with --map"
[ "$lockstep" = 0 ] || [ -z "$replay" ] || fail "--replay plays in real time, since lcm-logplayer waits for nobody; in lock-step plays --log"
[ "$profile" = "" ] || [ "$profile" = dm ] || [ "$profile" = baseline ] || fail "--profile $profile: write dm or baseline"

if [ -z "$build" ]; then
  build="$top/build/release"
  "$top/scripts/build.sh" release dmslam-{player,frontend,mapper,loopcloser,collector,map} >&2 ||
    fail "the build failed; its log is above"
  [ "$viewer" = 0 ] || "$top/scripts/build.sh" release dmslam-viewer >&2 ||
    fail "the viewer could not be built; scripts/setup.sh viewer installs what it needs"
fi
bin="$build/bin"
[ -x "$bin/dmslam-frontend" ] || fail "$bin has no dmslam-frontend; build first, or leave --build-dir out"
[ "$viewer" = 0 ] || [ -x "$bin/dmslam-viewer" ] ||
  fail "$bin has no dmslam-viewer; install what it needs with scripts/setup.sh viewer and build again"

port_taken() { grep -qi ":$(printf '%04X' "$1") " /proc/net/udp /proc/net/udp6 2>/dev/null; }
if [ -n "$port" ]; then
  [[ "$port" =~ ^[0-9]+$ ]] && [ "$port" -ge 1024 ] && [ "$port" -le 65535 ] || fail "--port $port: write a port between 1024 and 65535"
  if [ "$share_port" = 0 ] && port_taken "$port"; then fail "UDP port $port is taken; choose another with --port, leave it out, or give --share-port"; fi
else
  for _ in $(seq 50); do
    port=$((20000 + RANDOM % 30000))
    port_taken "$port" || break
  done
fi
url="udpm://239.255.76.67:$port?ttl=0&recv_buf_size=$receive_buffer"

mkdir -p "$out/log" || fail "$out cannot be made; check --out"
session=$((RANDOM * 32768 + RANDOM + 1))
if [ -n "$map" ]; then # ids of this session come after those of the map
  newest=$("$bin/dmslam-map" --log "$map" 2>"$out/log/map.log" | sed -nE 's/^log .* session ([0-9]+),.*/\1/p')
  [ -n "$newest" ] || fail "$(tail -n 1 "$out/log/map.log" | sed 's/^\(\[[^]]*\] *\)*//')"
  session=$((newest + 1))
  mapper+=(--map "$map")
  common+=(--set map.saved=on)
  [ "$localize" = 0 ] || common+=(--set map.localize_only=on)
fi
common+=(--set "seed=$seed" --lcm-url "$url" --session "$session"
  --peers frontend,mapper,loopcloser,collector)
[ -n "$profile" ] && common=(--set "profile=$profile" "${common[@]}")
[ -n "$camera" ] && player+=(--camera "$camera") changed+=(--camera "$camera")
[ -n "$replay" ] && common+=(--accept-recorded)
[ "$lockstep" = 1 ] && player+=(--lockstep)
ground_truth=()
[ -f "$sequence/groundtruth.txt" ] && ground_truth=(--ground-truth "$sequence/groundtruth.txt")
drawing=()
if [ "$pictures" != 0 ]; then
  mkdir -p "$out/pictures"
  drawing=(--picture-dir "$out/pictures" --picture-every "$pictures")
fi

declare -A pid_of=()
logger="" viewer_pid=""
alive() { # of these pids
  local p
  for p in "$@"; do kill -0 "$p" 2>/dev/null && return 0; done
  return 1
}
wait_for() { # at most so many twentieths of a second, for these pids
  local i most=$1; shift
  for ((i = 0; i < most; ++i)); do alive "$@" || return 0; sleep 0.05; done
  return 1
}
stop_all() {
  trap '' INT TERM
  trap - EXIT
  local p
  for p in "${pid_of[@]}"; do kill -TERM "$p" 2>/dev/null || true; done
  [ -n "$logger" ] && kill -INT "$logger" 2>/dev/null || true
  [ -n "$viewer_pid" ] && kill -TERM "$viewer_pid" 2>/dev/null || true
  wait_for 100 "${pid_of[@]}" $logger $viewer_pid || for p in "${pid_of[@]}" $logger $viewer_pid; do kill -KILL "$p" 2>/dev/null || true; done
}
exec 3>&2  # where we speak; what bash says about its jobs goes nowhere
trap 'stop_all; echo "$me: interrupted; what was tracked is in $out" >&3; exit 130' INT
trap 'stop_all; exit 143' TERM HUP
trap stop_all EXIT

# Whatever becomes of this script, its processes end with it.
guard=()
command -v setpriv >/dev/null && guard=(setpriv --pdeathsig TERM --)
quiet=() errors=""
[ ! -t 2 ] || quiet=(--quiet) errors=/dev/fd/3
declare -A restarts_of=() began_at=() short_lives=()
mapper_arguments=("${common[@]}" "${mapper[@]}")
loopcloser_arguments=("${common[@]}")
frontend_arguments=("${common[@]}" "${drawing[@]}")
collector_arguments=("${common[@]}" "${quiet[@]}" --out "$out" "${ground_truth[@]}")
player_arguments=("${common[@]}" "${player[@]}" --sequence "$sequence")
player_program="$bin/dmslam-player"
[ -z "$log_file" ] || player_arguments=("${common[@]}" "${player[@]}" --log "$log_file")
# What a process said before it failed: its error, or what its command line lacked.
why() {
  local log="$out/log/$1.log" line
  [ -f "$log" ] || return 0
  line=$(grep -hE " (error|critical): " "$log" | tail -n 1 | sed -E 's/^[0-9:.]* //; s/ (error|critical): /: /' || true)
  [ -n "$line" ] || line=$(grep -vE '^[0-9:.]+ |^ *$' "$log" | head -n 1 | sed "s/^/$1: /" || true)
  [ -n "$line" ] || line=$(tail -n 1 "$log" | sed -E 's/^[0-9:.]* //' || true)
  echo "$line"
}
# lcm-logplayer, and then the end of the sequence again until the frontend has heard it: it travels unacknowledged.
replay_log='
url=$1 speed=$2 log=$3 frontend_pid=$4
port=$(sed -E "s/.*:([0-9]+)\?.*/\1/" <<<"$url")
for ((i = 0; i < 200; ++i)); do
  [ "$(grep -ci ":$(printf %04X "$port") " /proc/net/udp)" -lt 4 ] || break
  sleep 0.05
done
sleep 0.5
lcm-logplayer -s "$speed" -l "$url" -e ".*DMSLAM_PLAYER_(CAMERA_INFO|FRAME|GROUND_TRUTH|END_OF_SEQUENCE)$" "$log" || exit
for ((i = 0; i < 60; ++i)); do
  kill -0 "$(<"$frontend_pid")" 2>/dev/null || exit 0
  [ $((i % 4)) != 3 ] || lcm-logplayer -s 1000 -l "$url" -e ".*DMSLAM_PLAYER_END_OF_SEQUENCE$" "$log"
  sleep 0.25
done
echo "the log has no end of the sequence; the frontend is told to finish" >&2
kill -TERM "$(<"$frontend_pid")"
'
if [ -n "$replay" ]; then
  command -v lcm-logplayer >/dev/null || fail "lcm-logplayer is missing; install liblcm-bin (scripts/setup.sh core)"
  channels=$("$bin/dmslam-map" --log "$replay" --channels 2>"$out/log/map.log") || fail "$(tail -n 1 "$out/log/map.log" | sed 's/^\(\[[^]]*\] *\)*//')"
  grep -q 'DMSLAM_PLAYER_FRAME ' <<<"$channels" || fail "$replay: holds no frames of a camera; was the player recorded too?"
  recorded_prefix=$(sed -nE '/DMSLAM_PLAYER_FRAME /{s/^(.*)DMSLAM_PLAYER_FRAME .*/\1/p;q}' <<<"$channels")
  if [ ${#changed[@]} -gt 0 ] || [ "$recorded_prefix" != "$prefix" ]; then # lcm-logplayer plays whole logs, as they are
    "$bin/dmslam-player" --prefix "$prefix" "${changed[@]}" --log "$replay" --to-log "$out/log/replayed.lcmlog" 2>"$out/log/player.log" ||
      fail "$(why player)"
    replay=$out/log/replayed.lcmlog
  fi
  player_program=bash
  player_arguments=(-c "$replay_log" replay "$url" "$speed" "$replay" "$out/log/frontend.pid")
fi
launch() { # name: begins a process, or begins it again; only at the beginning nobody else can be writing
  local name=$1 log="$out/log/$1.log" said="$out/log/$1.log" program="$bin/dmslam-$1"
  [ "$name" != player ] || program=$player_program
  local -n arguments="${name}_arguments"
  local fresh=(--fresh-system)
  if [ -n "${began_at[$name]:-}" ]; then fresh=(); else : >"$log"; fi
  if [ "$name" = collector ]; then said="$out/log/table.txt" log=${errors:-$log}; fi
  "${guard[@]}" "$program" "${arguments[@]}" "${fresh[@]}" </dev/null >>"$said" 2>>"$log" &
  pid_of[$name]=$!
  echo $! >"$out/log/$name.pid"
  began_at[$name]=$SECONDS
}
rm -f "$out/log/table.txt"
if [ "$record" = 1 ]; then
  command -v lcm-logger >/dev/null || fail "lcm-logger is missing; install liblcm-bin (scripts/setup.sh core)"
  rm -f "$out/run.lcmlog"
  "${guard[@]}" lcm-logger --quiet --lcm-url="$url" "$out/run.lcmlog" </dev/null >"$out/log/logger.log" 2>&1 &
  logger=$!
fi
# Nobody waits for the viewer, and its end is nobody's failure.
open_viewer() {
  local i address="" log="$out/log/viewer.log"
  : >"$log"
  "${guard[@]}" "$bin/dmslam-viewer" "${common[@]}" "${http[@]}" "${ground_truth[@]}" </dev/null >>"$log" 2>&1 &
  viewer_pid=$!
  for ((i = 0; i < 100; ++i)); do
    address=$(sed -nE 's/.*to be seen at (http[^ ]*).*/\1/p' "$log")
    if [ -n "$address" ] || ! alive "$viewer_pid"; then break; fi
    sleep 0.05
  done
  if [ -z "$address" ]; then fail "the viewer did not start: $(why viewer)"; fi
  echo "$me: to be seen at $address" >&3
  if [ -n "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ] && command -v xdg-open >/dev/null; then
    xdg-open "$address" </dev/null >/dev/null 2>&1 &
  fi
}
if [ "$viewer" = 1 ]; then open_viewer; fi
for name in mapper loopcloser frontend collector player; do launch "$name"; done

report() { # name, status
  local message
  message=$(why "$1")
  if [ "$1" = collector ] && [ -t 3 ]; then return; fi  # it has spoken on the terminal itself
  if [ "$2" -gt 128 ]; then message="$1 was ended by signal $(($2 - 128)); its log is $out/log/$1.log"; fi
  echo "$me: ${message:-$1 ended with code $2; its log is $out/log/$1.log}" >&3
}

# Died of a signal or an internal error, or found that another process knows more: the others go on, and so can it.
# What it refuses to do, as with a wrong option, it would refuse again; and what dies as soon as it lives is past help.
may_restart() { # name, status
  [ "$restart" = 1 ] && [ "$collected" = 0 ] && [ "$code" = 0 ] || return 1
  [ "$2" -gt 128 ] || [ "$2" = 70 ] || [ "$2" = 8 ] || return 1
  if [ $((SECONDS - began_at[$1])) -ge 3 ]; then short_lives[$1]=0; fi
  short_lives[$1]=$((${short_lives[$1]:-0} + 1))
  [ "${short_lives[$1]}" -le 3 ]
}
restart_it() { # name, status
  restarts_of[$1]=$((${restarts_of[$1]:-0} + 1))
  local how="ended with code $2"
  if [ "$2" -gt 128 ]; then how="was ended by signal $(($2 - 128))"; fi
  echo "$me: $1 $how; started again (${restarts_of[$1]})" >&3
  launch "$1"
}

exec 2>/dev/null
# The collector ends last. Whoever dies before it is started again; whoever fails ends the run.
code=0
collected=0
while [ ${#pid_of[@]} -gt 0 ]; do
  ended=""
  status=0
  wait -n -p ended "${pid_of[@]}" || status=$?
  for name in "${!pid_of[@]}"; do
    if [ "${pid_of[$name]}" = "$ended" ]; then break; fi
  done
  unset "pid_of[$name]"
  if [ "$status" != 0 ] && may_restart "$name" "$status"; then
    restart_it "$name" "$status"
    continue
  fi
  if [ "$status" != 0 ] && [ "$code" = 0 ]; then
    report "$name" "$status"
    code=$status
  fi
  [ "$name" = collector ] && collected=1
  # Once the results are there the others have a moment to end by themselves; after a failure they are told to.
  if [ "$code" != 0 ] || { [ "$collected" = 1 ] && ! wait_for 40 "${pid_of[@]}"; }; then break; fi
done
# Who has a terminal can go on looking at what was made.
stay_open() {
  [ -n "$viewer_pid" ] && [ "$code" = 0 ] && [ -t 0 ] && [ -t 3 ] && alive "$viewer_pid" || return 0
  [ ! -s "$out/log/table.txt" ] || cat "$out/log/table.txt"
  rm -f "$out/log/table.txt"
  echo "$me: the results are in $out; the viewer stays until Ctrl-C" >&3
  trap 'stop_all; exit 0' INT
  wait "$viewer_pid" || true
}
stay_open
stop_all
[ ! -s "$out/log/table.txt" ] || cat "$out/log/table.txt"
if [ "$code" = 0 ]; then
  echo "results: $out (picture: $out/trajectory.png)"
fi
exit "$code"
