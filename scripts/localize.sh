#!/usr/bin/env bash
# How well frames are found in a saved map. See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
out=$top/out/localize data=${DMSLAM_DATA:-$top/../shared/data} build=$top/build/release camera=$top/config/kitchen.yaml
usage() {
  cat <<EOT
Usage: scripts/localize.sh [--out DIR] [--data DIR] [--seed N] [--build-dir DIR]

Maps kitchen and saves the map (once: DIR/kitchen.map), then looks for the frames of kitchen_walk1 and kitchen_walk2 in it
without changing it. These show what kitchen shows, with people before it, so each frame has a pose of the mapping run to be
compared with. Prints a table, and ends with 1 where less is reached than is asked.
EOT
}
fail() { echo "localize.sh: $*" >&2; exit 1; }
seed=1
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --out | --data | --seed | --build-dir)
      (($# > 1)) || fail "$1 needs a value (see --help)"
      name=${1#--}; printf -v "${name//-dir/}" %s "$2"; shift 2
      ;;
    *) fail "unknown option $1 (see --help)" ;;
  esac
done
[[ -d $data/kitchen ]] || fail "$data/kitchen is not there; set --data or DMSLAM_DATA"
mkdir -p "$out"
run() { "$build/bin/dmslam-inprocess" --camera "$camera" --seed "$seed" "$@" >"$out/log.txt" 2>&1 || fail "$(tail -n 1 "$out/log.txt")"; }
[[ -s $out/kitchen.map ]] || run --sequence "$data/kitchen" --out "$out/kitchen" --save-map "$out/kitchen.map"

# judge SEQUENCE OFFSET LEAST_PERCENT: frame i of it is kitchen's frame i + OFFSET.
judge() {
  python3 - "$data" "$out" "$1" "$2" "$3" <<'EOP'
import math
import sys

data, out, name, offset, least = sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4]), float(sys.argv[5])


def rows(path):
    with open(path) as file:
        return [line.split() for line in file if line.strip() and not line.startswith("#")]


def positions(path):
    return {row[0]: tuple(float(x) for x in row[1:4]) for row in rows(path)}


def nanoseconds(stamp):
    whole, _, part = stamp.partition(".")
    return int(whole) * 10**9 + int((part + "0" * 9)[:9])


def by_frame(path, stamps):
    index = {nanoseconds(stamp): i for i, stamp in enumerate(stamps)}
    return {index[nanoseconds(stamp)]: p for stamp, p in positions(path).items()}


mapped = by_frame(f"{out}/kitchen/trajectory.txt", [row[0] for row in rows(f"{data}/kitchen/rgb.txt")])
stamps = [row[0] for row in rows(f"{data}/{name}/rgb.txt")]
found = by_frame(f"{out}/{name}/trajectory_online.txt", stamps)
extent = max(math.dist(a, b) for a in mapped.values() for b in mapped.values())
errors = sorted(math.dist(p, mapped[i + offset]) / extent * 100 for i, p in found.items() if i + offset in mapped)
percent = 100 * len(found) / len(stamps)
median, p95 = (errors[int(q * (len(errors) - 1))] if errors else math.inf for q in (0.5, 0.95))
good = percent >= least and median <= 0.3 and p95 <= 1
print(f"{name:16s} found {percent:5.1f} % (asked {least:.0f})   median {median:.3f} % (0.3)   95th percentile {p95:.3f} % (1)"
      f"   largest {errors[-1] if errors else math.inf:.2f} %   {'reached' if good else 'MISSED'}")
sys.exit(0 if good else 1)
EOP
}
status=0
for item in "kitchen_walk1 0 95" "kitchen_walk2 300 90"; do
  read -r name offset least <<<"$item"
  run --sequence "$data/$name" --out "$out/$name" --map "$out/kitchen.map" --localize
  judge "$name" "$offset" "$least" || status=1
done
exit $status
