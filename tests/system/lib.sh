# shellcheck shell=bash
# What the system tests share. Sourced first: moves the test into a network namespace of its own.
set -uo pipefail
readonly SKIPPED=77
root=${DMSLAM_SOURCE_DIR:?set by ctest}
build=${DMSLAM_BUILD_DIR:?set by ctest}

if [[ -z ${DMSLAM_IN_NAMESPACE:-} ]]; then
  export DMSLAM_IN_NAMESPACE=1
  if unshare --net true 2>/dev/null; then exec unshare --net bash "$0" "$@"; fi
  if unshare --user --map-root-user --net true 2>/dev/null; then exec unshare --user --map-root-user --net bash "$0" "$@"; fi
  echo "SKIPPED: this machine allows no network namespaces (unshare --net), neither as root nor as user"
  exit $SKIPPED
fi

multicast() { ip link set lo up && ip link set lo multicast on && ip route replace 224.0.0.0/4 dev lo; }

work=$(mktemp -d)
failures=0
mine() { # the project's programs in this namespace: "PID: COMMAND LINE"
  local dir line
  for dir in /proc/[0-9]*; do
    [[ $dir/ns/net -ef /proc/self/ns/net ]] || continue
    line=$({ tr '\0' ' ' <"$dir/cmdline"; } 2>/dev/null) || continue
    [[ $line != *bin/dmslam-* ]] || printf '%s: %s\n' "${dir#/proc/}" "$line"
  done
}
cleanup() {
  local pid
  while IFS=: read -r pid _; do kill -KILL "$pid" 2>/dev/null; done < <(mine)
  rm -rf -- "$work"
}
trap cleanup EXIT

failed() {
  printf 'FAILED: %s\n' "$*"
  failures=$((failures + 1))
}
check() { # DESCRIPTION COMMAND...
  local description=$1
  shift
  "$@" || failed "$description"
}
finish() {
  ((failures == 0)) || { printf '%d checks failed\n' "$failures"; exit 1; }
  echo "all checks passed"
}

# run ARGUMENTS...: scripts/run.sh with the programs under test.
run() { "$root/scripts/run.sh" --build-dir "$build" "$@"; }

says() { # PATTERN NAME...: within half a minute each $work/NAME.log says it
  local name i
  for name in "${@:2}"; do
    for ((i = 0; i < 600; ++i)); do grep -qsE -- "$1" "$work/$name.log" && break; sleep 0.05; done
    check "$name says '$1': $(<"$work/$name.log")" grep -qsE -- "$1" "$work/$name.log"
  done
}

no_orphans() { # within some seconds
  local i
  for ((i = 0; i < 200; ++i)); do
    [[ -n $(mine) ]] || return 0
    sleep 0.05
  done
  failed "processes are left after: $1"
  mine
}

# refused PATTERN LINES COMMAND...: ends with a code that is not zero, says one line that matches, leaves nothing behind.
refused() {
  local pattern=$1 status=0 said
  shift
  said=$("$@" 2>&1 </dev/null) || status=$?
  said=$(grep -vE '^  |^ *$' <<<"$said") # the table of what there is may follow
  ((status != 0 && status < 128)) || failed "$* ended with $status"
  grep -qiE -- "$pattern" <<<"$said" || failed "$* does not say '$pattern' but: $said"
  (($(wc -l <<<"$said") == 1)) || failed "$* says more than one line: $said"
  no_orphans "$*"
}

# field FILE KEY: a value of summary.json.
field() { sed -nE "s/^ *\"$2\": *([^,]*),?$/\1/p" "$1/summary.json" | head -n 1; }
# holds 'a >= b': arithmetic on decimal numbers.
holds() { awk "BEGIN { exit !($1) }" </dev/null; }
expect() { # DESCRIPTION FOLDER KEY RELATION
  local value
  value=$(field "$2" "$3")
  if [[ ! $value =~ ^-?[0-9.e+-]+$ ]] || ! holds "$value $4"; then failed "$1: $3 is ${value:-absent}, wanted $4"; fi
}

data=${DMSLAM_DATA:-$root/../shared/data}
need_data() {
  [[ -d $data/$1 ]] && return
  echo "SKIPPED: $data/$1 is not there; set DMSLAM_DATA to the folder that holds $1"
  exit $SKIPPED
}
find_python() { # one with ctypes, for examples/python (python3-minimal has none)
  for python in /usr/bin/python3 python3; do "$python" -c 'import ctypes, select' 2>/dev/null && return; done
  python=""
}
need_synthetic() { # sequence rendered before, see CMakeLists.txt
  synthetic=$build/synthetic
  [[ -s $synthetic/rgb.txt ]] || { echo "FAILED: $synthetic was not rendered"; exit 1; }
}
