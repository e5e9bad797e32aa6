#!/usr/bin/env bash
# A map made by two runs, one after the other, or joined of two maps. See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
out=$top/out/sessions data=${DMSLAM_DATA:-$top/../shared/data} build=$top/build/release camera=$top/config/kitchen.yaml
usage() {
  cat <<EOT
Usage: scripts/sessions.sh [--out DIR] [--data DIR] [--seed N] [--build-dir DIR]

Maps the first and the second half of kitchen, each alone, then each half in the saved map of the other one, and joins the
two maps with dmslam-map merge. Prints the error of both halves together, laid onto the truth by one similarity, where the
cameras of both are in one map, and ends with 1 where it is larger than 0.010 m. What is there already in DIR is not made
again.
EOT
}
fail() { echo "sessions.sh: $*" >&2; exit 1; }
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
map() { "$build/bin/dmslam-map" "$@" >"$out/map.txt" 2>&1 || fail "$(tail -n 1 "$out/map.txt")"; }
# run NAME START ARGUMENTS...: 500 frames from START on, which end in NAME.map.
run() {
  local name=$1 start=$2
  shift 2
  [[ -s $out/$name.map ]] || "$build/bin/dmslam-inprocess" --sequence "$data/kitchen" --camera "$camera" --seed "$seed" \
    --start "$start" --frames 500 --out "$out/$name" --save-map "$out/$name.map" "$@" >"$out/log.txt" 2>&1 ||
    fail "$(tail -n 1 "$out/log.txt")"
  map --map "$out/$name.map" --keyframes "$out/$name.keyframes.txt"
}

# judge WHAT JOINED PART...: every part is a run whose saved map went into that of JOINED; "=" is before a run that was
# made in that map, whose frames need no carrying over.
judge() {
  python3 - "$top/scripts/lib" "$data/kitchen/groundtruth.txt" "$out" "$@" <<'EOP'
import math
import pathlib
import statistics
import sys

sys.path.insert(0, sys.argv[1])
from trajectories import errors, read  # noqa: E402

truth, out = read(pathlib.Path(sys.argv[2])), pathlib.Path(sys.argv[3])
name, joined, parts = sys.argv[4], sys.argv[5], sys.argv[6:]


def turned(q, v):
    x, y, z, w = q
    t = [2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])]
    return [v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2],
            v[2] + w * t[2] + x * t[1] - y * t[0]]


def carried(poses, before, after):
    """Centres of frames beside the nearest of the keyframes that are in both maps."""
    both = [s for s in before if s in after]
    pairs = [(a, b) for a in both for b in both if a < b]
    spread = [sum(math.dist(m[a][:3], m[b][:3]) for a, b in pairs) for m in (before, after)]
    scale = spread[1] / spread[0]
    result = {}
    for stamp, pose in poses.items():
        near = min(both, key=lambda s: abs(s - stamp))
        then, now = before[near], after[near]
        inverse = [-then[3], -then[4], -then[5], then[6]]
        beside = turned(inverse, [p - c for p, c in zip(pose[:3], then[:3])])
        result[stamp] = [c + scale * b for c, b in zip(now[:3], turned(now[3:], beside))]
    return result


keyframes = read(out / f"{joined}.keyframes.txt")
estimate = {}
for part in parts:
    own = part.startswith("=")
    poses = read(out / part.lstrip("=") / "trajectory.txt")
    estimate.update(poses if own else carried(poses, read(out / f"{part}.keyframes.txt"), keyframes))
ate = math.sqrt(statistics.fmean(e * e for e in errors(truth, estimate).values()))
good = ate <= 0.010 and len(estimate) >= 0.9 * len(truth)
print(f"{name:40s} {len(estimate):4d} of {len(truth)} frames, joint ATE {ate:.4f} m (asked 0.0100)   "
      f"{'reached' if good else 'MISSED'}")
sys.exit(0 if good else 1)
EOP
}
run a 0
run b 500
run ab 500 --map "$out/a.map"
run ba 0 --map "$out/b.map"
status=0
judge "the second half in the first one's map" ab a =ab || status=1
judge "the first half in the second one's map" ba b =ba || status=1
join() { # NAME FIRST SECOND
  map merge "$out/$2.map" "$out/$3.map" --renumber --save "$out/$1.map"
  map --map "$out/$1.map" --keyframes "$out/$1.keyframes.txt"
  judge "both, joined: $2 and $3" "$1" "$2" "$3" || status=1
}
join a+b a b
join b+a b a
exit $status
