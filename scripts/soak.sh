#!/usr/bin/env bash
# Plays a sequence forwards and backwards for a long time, and watches the memory of each process. See --help.
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
source "$top/scripts/lib/to_and_fro.sh"
usage() {
  cat <<'EOF'
Usage: scripts/soak.sh --sequence DIR --out DIR [options]

Plays a TUM RGB-D folder in real time forwards, backwards, forwards ... for an hour, and writes the resident memory of each
process every ten seconds into DIR/memory.csv. Once the map is built (after a third of the time) nothing may grow: from the
third quarter to the last the mean memory by 5 MB per hour (and 2 MB by chance) at most, and the median time from image to
pose by 20 %. Writes DIR/table.md, with the errors of each quarter where there is a ground truth; ends with 1 where
something grows.

  --camera FILE      camera file (YAML)
  --seconds N        how long (default 3600)
  --speed X          factor on the recorded rate (default 1)
  --build-dir DIR    where the programs are (default: build/release)
EOF
}
fail() { echo "soak.sh: $*" >&2; exit 1; }

sequence="" out="" seconds=3600 speed=1 build=$top/build/release camera=()
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --sequence) sequence=$2; shift 2 ;;
    --out) out=$2; shift 2 ;;
    --seconds) seconds=$2; shift 2 ;;
    --speed) speed=$2; shift 2 ;;
    --build-dir) build=$2; shift 2 ;;
    --camera) camera=(--camera "$2"); shift 2 ;;
    *) fail "unknown option $1 (see --help)" ;;
  esac
done
[[ -f $sequence/rgb.txt ]] || fail "$sequence has no rgb.txt: give a TUM RGB-D folder with --sequence"
mkdir -p "$out"
to_and_fro "$sequence" "$(awk "BEGIN { print $seconds * $speed }")" "$out/sequence"

"$top/scripts/run.sh" --build-dir "$build" --sequence "$out/sequence" "${camera[@]}" --speed "$speed" \
  --out "$out/run" >"$out/said.txt" 2>&1 &
runner=$!
trap 'kill -TERM "$runner" 2>/dev/null; wait; exit 130' INT TERM
echo "seconds,player,frontend,mapper,loopcloser,collector" >"$out/memory.csv"
resident() { # PROCESS: KiB; 0 when it is not there
  local pid=0 kib=0
  read -r pid 2>/dev/null <"$out/run/log/$1.pid" || true
  kib=$(sed -nE 's/^VmRSS:[^0-9]*([0-9]+).*/\1/p' "/proc/$pid/status" 2>/dev/null || true)
  echo "${kib:-0}"
}
began=$SECONDS
while kill -0 "$runner" 2>/dev/null; do
  echo "$((SECONDS - began)),$(resident player),$(resident frontend),$(resident mapper),$(resident loopcloser),$(resident collector)" \
    >>"$out/memory.csv"
  sleep 10
done
status=0
wait "$runner" || status=$?
python3 "$top/scripts/soak_table.py" "$out" >"$out/table.md" || status=1
cat "$out/table.md"
exit "$status"
