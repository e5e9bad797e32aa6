# The command lines of the systemd units, with the settings file that is installed beside them, make a whole run; what dies
# of a signal is started again as Restart=on-failure does, and the others go on.
source "$(dirname "$0")/lib.sh"
need_synthetic

declare -A setting=([DMSLAM_LCM_URL]="udpm://239.255.76.67:23421?ttl=0&recv_buf_size=4194304"
  [DMSLAM_OUT]=$work/out [DMSLAM_SEQUENCE]=$synthetic
  [DMSLAM_PLAYER_OPTIONS]="--camera $root/config/synthetic.yaml --lockstep")
while IFS='=' read -r key value; do
  [[ $key == DMSLAM_* ]] || continue
  export "$key=${setting[$key]:-$value}"
done <"$root/config/systemd/system.env"

unit() { # PROCESS: its command line as the unit has it, in $command; ${NAME} is one word, $NAME are several
  command=$(sed -n 's/^ExecStart=//p' "$root/config/systemd/dmslam-$1@.service" | sed -E 's/\$\{([A-Z_]+)\}/"${\1}"/g')
  [[ $command == dmslam-$1\ * ]] || failed "the unit of $1 starts '$command'"
}
supervise() { # PROCESS: until it ends with a code for which its unit does not start it again
  local status never
  never=" $(sed -n 's/^RestartPreventExitStatus=//p' "$root/config/systemd/dmslam-$1@.service") 0 "
  unit "$1"
  while :; do
    status=0
    bash -c "exec $build/bin/$command" >>"$work/$1.log" 2>&1 </dev/null || status=$?
    [[ $never != *" $status "* ]] || return "$status"
    echo "ended with $status" >>"$work/$1.restarts"
    sleep 0.2
  done
}
for process in mapper loopcloser frontend collector player; do
  supervise "$process" &
  [[ $process != collector ]] || collector=$!
done
# There is no network yet: everybody is started again until there is.
for process in mapper loopcloser frontend collector player; do
  for ((i = 0; i < 400; ++i)); do grep -qs "ended with 7" "$work/$process.restarts" && break; sleep 0.05; done
  check "$process waits for the network: $(tail -n 1 "$work/$process.log")" grep -qs "ended with 7" "$work/$process.restarts"
done
multicast
until grep -qs 'frame [0-9]* of' "$work/collector.log"; do
  kill -0 "$collector" 2>/dev/null || break
  sleep 0.05
done
kill -KILL "$(mine | sed -nE 's/^([0-9]+): .*bin\/dmslam-mapper .*/\1/p')"
wait "$collector" || failed "the collector ended with $?; its log: $(tail -n 3 "$work/collector.log")"
check "the mapper was started again" grep -qs "ended with 137" "$work/mapper.restarts"
check "results are in DMSLAM_OUT" test -s "$work/out/trajectory.txt"
expect "nothing is lost" "$work/out" records_lost "== 0"
expect "no keyframe is missing" "$work/out" keyframes_missing "== 0"
expect "the collector saw the restart" "$work/out" restarts "== 1"
no_orphans "the run"
finish
