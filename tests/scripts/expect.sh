# shellcheck shell=bash
# What the script tests share. Sourced, not run.
set -uo pipefail
failures=0
work=$(mktemp -d)
trap 'rm -rf -- "$work"' EXIT

# expect STATUS PATTERN COMMAND...: the command ends with that status (or "fail": any but 0), and its output (both
# streams, left in $output) matches the pattern.
expect() {
  local status=$1 pattern=$2 got=0
  shift 2
  output=$("$@" 2>&1 </dev/null) || got=$?
  if [[ $status == fail ]]; then ((got != 0 && got < 126)); else ((got == status)); fi || {
    printf 'FAILED: %s\n  ended with %s, wanted %s; it said:\n%s\n' "$*" "$got" "$status" "$output"
    failures=$((failures + 1))
  }
  grep -qE -- "$pattern" <<<"$output" || {
    printf 'FAILED: %s\n  does not say "%s"; it said:\n%s\n' "$*" "$pattern" "$output"
    failures=$((failures + 1))
  }
}

# check DESCRIPTION COMMAND...: the command succeeds.
check() {
  local description=$1
  shift
  "$@" >/dev/null 2>&1 || {
    printf 'FAILED: %s\n' "$description"
    failures=$((failures + 1))
  }
}

finish() {
  ((failures == 0)) || { printf '%d checks failed\n' "$failures"; exit 1; }
  echo "all checks passed"
}
