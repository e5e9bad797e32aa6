# Processes that die together, one that hangs, and one whose core hangs: dmslam-run misses none, and the run comes to its end.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
arguments=(--sequence "$synthetic" --camera "$root/config/synthetic.yaml" --lockstep --seed 1 --watchdog 4)

pid_of() { # PROCESS
  mine | sed -nE "s/^([0-9]+): [^ ]*bin\/dmslam-$1 .*/\1/p" | head -n 1
}
frames() { sed -nE 's/.*frame ([0-9]+) of .*/\1/p' "$work/$1/log/collector.log" 2>/dev/null | tail -n 1; }
# begin NAME FRAME: a run in the background, until its collector has seen that frame; sets `runner`.
begin() {
  "$root/scripts/run.sh" --build-dir "$build" "${arguments[@]}" --out "$work/$1" >"$work/$1.said" 2>&1 </dev/null &
  runner=$!
  local i frame
  for ((i = 0; i < 1200; ++i)); do
    frame=$(frames "$1")
    ((${frame:--1} < $2)) || return
    sleep 0.05
  done
  failed "'$1' did not begin: $(cat "$work/$1.said")"
}
strike() { # SIGNAL PROCESS...: at once
  local signal=$1 pids=() process
  shift
  for process in "$@"; do pids+=("$(pid_of "$process")"); done
  kill "-$signal" "${pids[@]}"
}
ends() { # NAME RESTARTS
  local status=0
  wait "$runner" || status=$?
  ((status == 0)) || failed "'$1' ended with $status; it said: $(cat "$work/$1.said")"
  (($(grep -c "started again" "$work/$1.said") == $2)) || failed "'$1' did not start $2 again: $(cat "$work/$1.said")"
  check "'$1' has results" test -s "$work/$1/trajectory.txt"
  no_orphans "$1"
}

begin two 40
strike KILL player collector
ends two 2
expect "nothing is lost with player and collector" "$work/two" records_lost "== 0"
expect "no keyframe is missing with player and collector" "$work/two" keyframes_missing "== 0"
expect "both are counted" "$work/two" restarts "== 2"

# What a collector counted is known to the next one.
begin counted 40
strike KILL mapper
until grep -qs "mapper .*started again" "$work/counted.said"; do sleep 0.05; done
sleep 2
strike KILL collector
ends counted 2
expect "who died before the collector is counted" "$work/counted" restarts "== 2"
expect "no keyframe is missing" "$work/counted" keyframes_missing "== 0"
expect "no record is lost" "$work/counted" records_lost "== 0"
expect "all frames were processed, whoever counted them" "$work/counted" frames_processed "== 150"

begin five 80
strike KILL player collector frontend mapper loopcloser
ends five 5
expect "all five are counted" "$work/five" restarts "== 5"
expect "all frames are there" "$work/five" frames "== 150"
expect "it is known that all had died" "$work/five" resumed "== 1"
expect "keyframes that came after the checkpoint are not missing without a word" "$work/five" keyframes_missing "== 0"
check "the map was on the disk" grep -q "checkpoint.lcmlog: continues with [0-9]* keyframes" "$work/five/log/mapper.log"

begin hung 40
strike STOP mapper
ends hung 1
check "it says who hung" grep -q "mapper said nothing for too long" "$work/hung.said"
expect "nothing is lost with a mapper that hangs" "$work/hung" records_lost "== 0"

# stop_threads PID [NAME]: those of that name, or all but the main one, until the process is dead.
stop_threads() {
  "$python" - "$@" <<'STOP_THREADS' &
import ctypes, os, sys
ptrace = ctypes.CDLL(None).ptrace
ptrace.argtypes = [ctypes.c_long, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
main = int(sys.argv[1])
for thread in map(int, os.listdir(f"/proc/{main}/task")):
    name = open(f"/proc/{main}/task/{thread}/comm").read().strip()
    if thread != main and name in (sys.argv[2:] or [name]):
        ptrace(0x4206, thread, None, None)  # PTRACE_SEIZE
        ptrace(0x4207, thread, None, None)  # PTRACE_INTERRUPT
try:
    while True:
        os.waitpid(-1, 0x40000000)  # until all of them are dead
except ChildProcessError:
    pass
STOP_THREADS
}
find_python
if [[ -z $python ]]; then
  echo "left out: there is no python with ctypes to stop a single thread with"
else
  # In lock-step the core has no thread of its own: there is LCM's, which receives.
  begin deaf 40
  stop_threads "$(pid_of mapper)"
  ends deaf 1
  check "the mapper says that it is deaf" grep -q "LCM hears not even this process" "$work/deaf/log/mapper.log"
  expect "nothing is lost with a mapper that is deaf" "$work/deaf" records_lost "== 0"

  # Only its core hangs: its loop turns, hears, and speaks on the bus.
  arguments=(--sequence "$synthetic" --camera "$root/config/synthetic.yaml" --seed 1 --watchdog 2)
  begin core 20
  stop_threads "$(pid_of mapper)" core
  ends core 1
  check "the mapper says that its core hangs" grep -q "a job has given no sign" "$work/core/log/mapper.log"
  check "it is killed" grep -q "mapper said nothing for too long" "$work/core.said"
fi
finish
