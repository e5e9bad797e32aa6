# Ctrl-C, a process that dies, a runner that is killed: nothing is left behind.
source "$(dirname "$0")/lib.sh"
need_synthetic
multicast
arguments=(--sequence "$synthetic" --camera "$root/config/synthetic.yaml" --speed 0.2)

# begin NAME: a run in the background, until its frontend is there; sets `runner`.
begin() {
  local i
  set -m # a process group of its own, with the interrupt signal not ignored
  # Not the function `run`: its subshell, not the runner, would get the signals.
  "$root/scripts/run.sh" --build-dir "$build" "${arguments[@]}" --out "$work/$1" >"$work/$1.said" 2>&1 </dev/null &
  runner=$!
  set +m
  for ((i = 0; i < 400; ++i)); do
    if [[ $(mine | grep -cE 'bin/dmslam-(player|frontend|mapper|loopcloser|collector) ') -ge 5 ]]; then
      sleep 1
      return
    fi
    sleep 0.05
  done
  failed "the processes of '$1' did not start: $(cat "$work/$1.said")"
}
ended_with() { # STATUS DESCRIPTION
  local status=0
  wait "$runner" || status=$?
  ((status == $1)) || failed "$2 ended with $status, wanted $1; it said: $(cat "$work"/*.said)"
  no_orphans "$2"
}

begin interrupted
kill -INT -- "-$runner"
ended_with 130 "Ctrl-C"

begin terminated
kill -TERM "$runner"
ended_with 143 "SIGTERM"

begin killed
kill -KILL "$runner"
ended_with 137 "the runner's own death"

arguments+=(--no-restart)
begin died
kill -KILL "$(cat "$work/died/log/mapper.pid")"
ended_with 137 "the mapper's death"
check "says who died" grep -q "mapper was ended by signal 9" "$work/died.said"
finish
