#!/usr/bin/env bash
# All benchmarks, and a table of them with the ratios to cv::ORB on the same frames in the same run. See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
out=$top/out/bench min_time=0.5 counts=0 tour=0 build=""
usage() {
  cat <<EOF
Usage: scripts/bench.sh [--out DIR] [--counts] [--tour] [--min-time S] [--build-dir DIR]

Builds and runs everything below tests/bench, one program after the other, and writes DIR/table.md: what was measured, its
ratio to cv::ORB (1000 features) in the same program's run, and the bars with what was reached. The programs' own results
are DIR/<program>.json. Ends with 1 where a required bar is missed.
Extraction, matching and the tracking of whole frames use the kitchen sequence in \$DMSLAM_DATA (default: ../shared/data).

  --out DIR       default: out/bench in the project
  --counts        also count instructions of the hot paths with callgrind: they are the same on a busy machine
  --tour          also let a map grow to 5,000 keyframes (some ten minutes), and let a process join one of that size
  --min-time S    seconds per benchmark (default 0.5)
  --build-dir DIR where the programs are (default: build/release, built first)
EOF
}
die() { echo "bench.sh: $*" >&2; exit 1; }
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --counts) counts=1; shift ;;
    --tour) tour=1; shift ;;
    --out | --min-time | --build-dir)
      (($# > 1)) || die "$1 needs a value; see --help"
      case $1 in --out) out=$2 ;; --min-time) min_time=$2 ;; *) build=$2 ;; esac
      shift 2
      ;;
    *) die "unknown option $1; see --help" ;;
  esac
done

export DMSLAM_SOURCE_DIR=$top DMSLAM_DATA=${DMSLAM_DATA:-$top/../shared/data}
benches=(features_bench tracking_bench optimization_bench motion_segmentation_bench place_bench wire_bench)
if [[ -z $build ]]; then
  build=$top/build/release
  cmake -S "$top" --preset release -DDMSLAM_BUILD_BENCH=ON >/dev/null
  ninja -C "$build" "${benches[@]}" extractor_quality hot_paths tour_bench late_comer map_size dmslam-map-tour >&2
fi
mkdir -p "$out"
for bench in "${benches[@]}"; do
  [[ -x $build/bin/$bench ]] || { echo "bench.sh: $bench was not built; left out" >&2; continue; }
  echo "bench.sh: $bench ..." >&2
  "$build/bin/$bench" --benchmark_min_time="$min_time" --benchmark_out="$out/$bench.json" \
    --benchmark_out_format=json >"$out/$bench.txt" 2>&1 || die "$bench failed: $(tail -n 1 "$out/$bench.txt")"
done
echo "bench.sh: extractor_quality ..." >&2
"$build/bin/extractor_quality" >"$out/quality.txt" 2>&1 || die "extractor_quality failed: $(tail -n 1 "$out/quality.txt")"

# Instructions per call: those of many calls less those of few.
count() { # PATH FEW MANY
  local times instructions=()
  for times in "$2" "$3"; do
    instructions+=("$(valgrind --tool=callgrind --callgrind-out-file="$out/callgrind.$1" "$build/bin/hot_paths" "$1" "$times" 2>&1 |
      sed -nE 's/.*Collected : ([0-9]+).*/\1/p')")
  done
  [[ -n ${instructions[1]:-} ]] || die "callgrind counted nothing for $1"
  echo "$1 $(((instructions[1] - instructions[0]) / ($3 - $2)))"
}
if ((counts)); then
  command -v valgrind >/dev/null || die "valgrind is missing; install it, or leave --counts out"
  for path in extract match pose bundle; do count "$path" 1 4; done >"$out/counts.txt"
fi
# A writer of a large map, and a reader that joins when it is whole.
join_late() {
  local url="udpm://239.255.76.67:$((20000 + RANDOM % 30000))?ttl=0&recv_buf_size=4194304" status=0
  "$build/bin/dmslam-map-tour" --lcm-url "$url" --fresh-system --rate 1000 </dev/null >"$out/map_tour.log" 2>&1 &
  local writer=$!
  trap 'kill $writer 2>/dev/null' EXIT
  for ((i = 0; i < 1200; ++i)); do
    if grep -q "the map is whole" "$out/map_tour.log" || ! kill -0 $writer 2>/dev/null; then break; fi
    sleep 0.1
  done
  timeout 60 "$build/bin/late_comer" --lcm-url "$url" || status=$?
  kill $writer
  trap - EXIT
  return $status
}
status=0
if ((tour)); then
  "$build/bin/tour_bench" | tee "$out/tour.txt" >&2 || status=1
  join_late | tee -a "$out/tour.txt" >&2 || status=1
  "$build/bin/map_size" --file "$out/map_size.log" | tee "$out/map_size.txt" >&2 || status=1
fi
python3 "$top/scripts/bench_table.py" "$out" || status=1
exit $status
