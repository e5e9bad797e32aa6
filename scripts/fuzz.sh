#!/bin/bash
# Fuzzes every reader of bytes from outside. Can be stopped and started again: libFuzzer's corpus is kept.
set -euo pipefail

usage() {
  cat <<EOF
Usage: scripts/fuzz.sh [--seconds N] [--mutations N] [--jobs N] [TARGET...]
  --seconds N    libFuzzer for N seconds per target (default 60; needs clang)
  --mutations N  instead: N fixed mutations per target under AddressSanitizer and UBSan, with any compiler
  --jobs N       compile with N jobs (default: all cores)
  TARGET         such as messages, streams, vocabulary; with --seconds also MapDelta and others (default: all)
Builds in build/fuzz (or build/asan-ubsan), keeps corpora in build/fuzz/corpus and findings in build/fuzz/findings.
EOF
}

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
seconds=60
mutations=0
jobs="$(nproc)"
targets=()
while (($# > 0)); do
  case "$1" in
    --seconds) seconds="$2"; shift 2 ;;
    --mutations) mutations="$2"; shift 2 ;;
    --jobs) jobs="$2"; shift 2 ;;
    -h | --help) usage; exit 0 ;;
    -*) echo "fuzz.sh: unknown option $1 (see --help)" >&2; exit 2 ;;
    *) targets+=("$1"); shift ;;
  esac
done
cmake_file="$root/tests/fuzz/CMakeLists.txt"
if ((${#targets[@]} == 0)); then
  mapfile -t targets < <(sed -n 's/^dmslam_fuzz(\([a-z_]*\) .*/\1/p' "$cmake_file")
  if ((mutations == 0)); then  # libFuzzer goes deeper with one type at a time
    read -r -a messages <<<"$(sed -n '/foreach(message/,/)/p' "$cmake_file" | tr -d ')\n' | sed 's/.*foreach(message//')"
    targets+=("${messages[@]}")
  fi
fi

cd "$root"
if ((mutations > 0)); then
  cmake --preset asan-ubsan >/dev/null
  cmake --build --preset asan-ubsan -j "$jobs" --target "${targets[@]/#/mutate_}"
  for target in "${targets[@]}"; do
    echo "== $target: $mutations mutations"
    "build/asan-ubsan/bin/mutate_$target" --count "$mutations"
  done
  exit 0
fi

command -v clang++ >/dev/null || {
  echo "fuzz.sh: libFuzzer needs clang: apt-get install clang, or use --mutations N" >&2
  exit 1
}
cmake --preset fuzz >/dev/null
cmake --build --preset fuzz -j "$jobs" --target "${targets[@]/#/fuzz_}" "${targets[@]/#/mutate_}"
failed=()
for target in "${targets[@]}"; do
  echo "== $target: $seconds s"
  corpus="build/fuzz/corpus/$target"
  mkdir -p "$corpus" build/fuzz/findings
  "build/fuzz/bin/mutate_$target" --write-seeds "$corpus"
  "build/fuzz/bin/fuzz_$target" "$corpus" -max_total_time="$seconds" -max_len=16384 -rss_limit_mb=2048 \
    -artifact_prefix="build/fuzz/findings/$target-" -print_final_stats=1 -verbosity=0 || failed+=("$target")
done
if ((${#failed[@]} > 0)); then
  echo "fuzz.sh: findings in: ${failed[*]}; the inputs are in build/fuzz/findings" >&2
  exit 1
fi
echo "no findings in ${#targets[@]} targets"
