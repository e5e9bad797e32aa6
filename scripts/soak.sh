#!/usr/bin/env bash
# Plays a sequence forwards and backwards for a long time, and watches the memory of each process. See --help.
set -euo pipefail

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
source "$top/scripts/lib/to_and_fro.sh"
usage() {
  cat <<'EOF'
Usage: scripts/soak.sh --sequence DIR --out DIR [options]

Plays a TUM RGB-D folder in real time forwards, backwards, forwards ... for an hour, and writes the resident memory of each
process every ten seconds into DIR/memory.csv. Once the map is built (after a third of the time) nothing may grow: the mean
memory of the last quarter may exceed that of the quarter before it by 3 % and 8 MB at most, and the median time from image
to pose by 20 %. Writes DIR/table.md, with the errors of each quarter where there is a ground truth.

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
awk -F, 'BEGIN { n = 0 } NR > 1 && $2 * $3 * $4 * $5 * $6 > 0 { at[n] = $1; for (c = 2; c <= 6; ++c) mb[n, c] = $c / 1024; ++n }
  NR == 1 { for (c = 2; c <= 6; ++c) name[c] = $c }
  END { print "| process | third quarter [MB] | last quarter [MB] | slope of the last half [MB/h] | verdict |\n|---|---|---|---|---|"
    for (c = 2; c <= 6; ++c) { a = b = na = nb = t = tt = tm = 0
      for (i = 0; i < n; ++i) {
        if (i >= n * 3 / 4) { b += mb[i, c]; ++nb } else if (i >= n / 2) { a += mb[i, c]; ++na }
        if (i >= n / 2) { h = at[i] / 3600; t += h; tt += h * h; tm += h * mb[i, c] } }
      if (na == 0 || nb == 0) { print "too short"; exit 1 }
      slope = ((na + nb) * tm - t * (a + b)) / ((na + nb) * tt - t * t)
      a /= na; b /= nb; bad = b > a * 1.03 && b > a + 8
      if (bad) worst = 1
      printf "| %s | %.1f | %.1f | %.1f | %s |\n", name[c], a, b, slope, bad ? "grows" : "flat" }
    exit worst }' "$out/memory.csv" >"$out/table.md" || status=1

# The quarters' times and errors.
python3 - "$out" "$build/bin/dmslam-eval" <<'EOF' >>"$out/table.md" || status=1
import json, os, subprocess, sys

out, evaluate = sys.argv[1:]
with open(f"{out}/run/summary.json") as file:
    quarters = json.load(file)["image_to_pose_ms_by_quarter"]
truth = f"{out}/sequence/groundtruth.txt"
with open(f"{out}/run/trajectory_online.txt") as file:
    poses = [line for line in file if not line.startswith("#")]
begin, end = (float(poses[i].split()[0]) for i in (0, -1))


def online_error(quarter):
    if not os.path.exists(truth) or os.path.getsize(truth) == 0:
        return "–"
    of_quarter = [p for p in poses if int(min(3, 4 * (float(p.split()[0]) - begin) / (end - begin))) == quarter]
    part = f"{out}/online_{quarter + 1}.txt"
    with open(part, "w") as file:
        file.writelines(of_quarter)
    subprocess.run([evaluate, truth, part, "--json", f"{out}/online.json"], check=True, stdout=subprocess.DEVNULL)
    with open(f"{out}/online.json") as file:
        return f"{json.load(file)['ate']['rmse']:.4f}"


print("\n| quarter | image to pose, p50 [ms] | p99 [ms] | poses online | ATE online |\n|---|---|---|---|---|")
for i, times in enumerate(quarters):
    count = sum(int(min(3, 4 * (float(p.split()[0]) - begin) / (end - begin))) == i for p in poses)
    print(f"| {i + 1} | {times['p50']:.1f} | {times['p99']:.1f} | {count} | {online_error(i)} |")
sys.exit(1 if quarters[3]["p50"] > 1.2 * quarters[2]["p50"] else 0)
EOF
cat "$out/table.md"
exit "$status"
