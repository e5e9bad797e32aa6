# shellcheck shell=bash
# What the scripts share that play many sequences, one after the other, and can be stopped and continued. Sourced; the
# script sets `root` (of the project) and `me` (its name in what it says).

: "${me:?}"
say() { printf '%s: %s\n' "$me" "$*" >&2; }
die() { say "$*"; exit 1; }

# need_programs PROGRAM...: sets `bin` to the folder that holds them, built where they are not there.
need_programs() {
  bin=${DMSLAM_BIN:-$root/build/release/bin}
  local program missing=()
  for program in "$@"; do
    [[ -x $bin/$program ]] || missing+=("$program")
  done
  ((${#missing[@]})) || return 0
  [[ -z ${DMSLAM_BIN:-} ]] || die "$bin does not hold ${missing[*]}; build them or unset DMSLAM_BIN"
  say "building ${missing[*]}"
  "$root/scripts/build.sh" release "${missing[@]}" >&2
}

# work_in FOLDER: sets `out` to it, alone in it from now on; an interrupt stops what `start` started.
work_in() {
  mkdir -p -- "$1" || die "$1 cannot be made"
  out=$(cd "$1" && pwd)
  exec 8>&2 9>"$out/.lock"
  flock -n 9 || die "another $me.sh is working in $out"
  trap interrupted INT TERM
}

# start COMMAND...: runs it in a process group of its own, so that an interrupt reaches it through us alone.
child=''
start() {
  local status=0
  set -m
  "$@" </dev/null 8>&- 9>&- &
  child=$!
  set +m
  wait "$child" || status=$?
  child=''
  return "$status"
}

# start_beside COMMAND...: starts it in a process group of its own and goes on. A function may be given: on an interrupt
# all that it has started ends with it.
beside=()
start_beside() {
  set -m
  "$@" </dev/null 8>&- 9>&- &
  beside+=("$!")
  set +m
}

# wait_beside LIMIT: waits until fewer than LIMIT of those run. Returns 1 where one that ended meanwhile failed.
wait_beside() {
  local pid running status=0
  while ((${#beside[@]} >= $1 && ${#beside[@]})); do
    wait -n "${beside[@]}" || status=1
    running=()
    for pid in "${beside[@]}"; do
      ! kill -0 "$pid" 2>/dev/null || running+=("$pid")
    done
    beside=(${running[@]+"${running[@]}"})
  done
  return "$status"
}

interrupted() {
  trap '' INT TERM
  exec 2>&8 # a run's output may be redirected at this moment
  if [[ -n $child ]]; then
    kill -TERM "$child" 2>/dev/null || true
    wait "$child" 2>/dev/null || true
  fi
  local pid
  for pid in ${beside[@]+"${beside[@]}"}; do
    kill -TERM -- "-$pid" 2>/dev/null || true
    wait "$pid" 2>/dev/null || true
  done
  progress_end
  say "stopped; the same command continues"
  exit 130
}

# On a terminal only.
progress_line() { [[ ! -t 2 ]] || printf '\r\033[K%s' "$*" >&2; }
progress_end() { progress_line ""; }

# has_summary FOLDER: whether the run in it left a result; one that was written in halves does not end with a brace.
has_summary() { [[ -s $1/summary.json && $(tail -c 2 "$1/summary.json" | tr -d '\0') == *'}' ]]; }

# finish_run PART FOLDER STATUS: the run's folder gets its name, and says why where there is no result, or where the run
# did not end well whatever it left. Returns 1 then.
finish_run() {
  if [[ $3 != 0 ]] || ! has_summary "$1"; then
    rm -f -- "$1/summary.json"
    { printf 'exit status %d: ' "$3"; grep -v '^ *$' "$1/log.txt" | tail -n 1 || true; echo; } >"$1/failed.txt"
  fi
  mv -- "$1" "$2"
  [[ -s $2/summary.json ]]
}
