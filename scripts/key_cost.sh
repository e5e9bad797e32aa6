#!/usr/bin/env bash
# What a key costs: the time and the bytes of all tags of one run. See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
readonly LARGEST_SHARE=3 TAG_BYTES=44
usage() {
  cat <<EOF
Usage: scripts/key_cost.sh --sequence DIR --out DIR [options]

Plays a TUM RGB-D folder with a key, adds up what its processes say of their tags when they end, and writes DIR/table.md:
tags made and verified, the CPU time that takes, and the bytes they add. Ends with 1 where it is more than $LARGEST_SHARE % of the
CPU time of all processes. (Two runs in turn, with and without a key, differ by more than a key costs.)

  --camera FILE      camera file (YAML)
  --frames N         so many frames (default 60)
  --encoding NAME    of the frames on the bus, as for dmslam-run
  --realtime         at the recorded rate; default: in lock-step
  --build-dir DIR    where the programs are (default: build/release)
EOF
}
fail() { echo "key_cost.sh: $*" >&2; exit 1; }

sequence="" out="" frames=60 build=$top/build/release pace=(--lockstep) options=()
while (($#)); do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --realtime) pace=(); shift; continue ;;
    --sequence | --out | --frames | --build-dir | --camera | --encoding) ;;
    *) fail "unknown option $1 (see --help)" ;;
  esac
  (($# > 1)) || fail "$1 needs a value (see --help)"
  case $1 in
    --build-dir) build=$2 ;;
    --camera | --encoding) options+=("$1" "$2") ;;
    *) printf -v "${1#--}" %s "$2" ;;
  esac
  shift 2
done
[[ -f $sequence/rgb.txt && -n $out ]] || fail "--sequence (a TUM RGB-D folder) and --out are needed (see --help)"
[[ $frames =~ ^[1-9][0-9]{0,8}$ ]] || fail "--frames $frames: write a number"
[[ -x $build/bin/dmslam-run ]] || fail "$build/bin/dmslam-run is not there; run scripts/build.sh"
mkdir -p -- "$out"
rm -rf -- "${out:?}/key" "$out/run"
(umask 077 && head -c 32 /dev/urandom | base64 >"$out/key")
"$build/bin/dmslam-run" --sequence "$sequence" ${pace[@]+"${pace[@]}"} ${options[@]+"${options[@]}"} --frames "$frames" \
  --key "$out/key" --out "$out/run" >"$out/said" 2>&1 || fail "the run ended with $?: $(tail -n 1 "$out/said")"

# One line of each: "PROCESS: key: N tags made, M verified, B bytes published, T ms of C ms of CPU time".
said=$(grep -hoE '[a-z]+: key: [0-9]+ tags made.*' "$out/run/log/"*.log) || fail "no process said what its key cost; see $out/run/log"
awk -v frames="$frames" -v tag="$TAG_BYTES" -v largest="$LARGEST_SHARE" '
  BEGIN { print "| process | tags made | verified | CPU time [ms] | of it for tags [ms] | share [%] |\n|---|---|---|---|---|---|" }
  { printf "| %s | %d | %d | %d | %.2f | %.2f |\n", substr($1, 1, length($1) - 1), $3, $6, $14, $11, 100 * $11 / $14
    made += $3; verified += $6; bytes += $8; spent += $11; all += $14 }
  END { printf "| all | %d | %d | %d | %.2f | %.2f |\n\n", made, verified, all, spent, 100 * spent / all
    printf "Per frame: %.1f messages of %.1f KB in all; their tags add %.2f KB (%.2f %%) and take %.3f of %.1f ms of CPU time.\n",
      made / frames, bytes / frames / 1024, made * tag / frames / 1024, 100 * made * tag / bytes, spent / frames, all / frames
    exit !(all > 0 && 100 * spent / all <= largest) }' <<<"$said" >"$out/table.md" ||
  { cat "$out/table.md"; fail "more than $LARGEST_SHARE % of the CPU time"; }
cat "$out/table.md"
