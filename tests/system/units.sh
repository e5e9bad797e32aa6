# shellcheck shell=bash
# Runs the command lines of the systemd units as systemd would. Sourced behind lib.sh.
units=(mapper loopcloser frontend collector player)

# set_system NAME=VALUE...: the settings file that is installed beside the units, with these values changed.
set_system() {
  local key value
  while IFS='=' read -r key value; do [[ $key != DMSLAM_* ]] || export "$key=$value"; done <"$root/config/systemd/system.env"
  export "$@"
}
# unit PROCESS: its command line as the unit has it, in $command; ${NAME} is one word, $NAME are several.
unit() {
  command=$(sed -n 's/^ExecStart=//p' "$root/config/systemd/dmslam-$1@.service" | sed -E 's/\$\{([A-Z_]+)\}/"${\1}"/g')
  [[ $command == dmslam-$1\ * ]] || failed "the unit of $1 starts '$command'"
}
# supervise PROCESS [NAME]: until it ends with a code for which its unit does not start it again. NAME is that of its log.
supervise() {
  local status never name=${2:-$1}
  never=" $(sed -n 's/^RestartPreventExitStatus=//p' "$root/config/systemd/dmslam-$1@.service") 0 "
  unit "$1"
  while :; do
    status=0
    bash -c "exec $build/bin/$command" >>"$work/$name.log" 2>&1 </dev/null || status=$?
    [[ $never != *" $status "* ]] || return "$status"
    echo "ended with $status" >>"$work/$name.restarts"
    sleep 0.2
  done
}
