#!/usr/bin/env bash
# Installs, builds, renders a synthetic sequence with walking people, runs the four processes on it, prints a table and
# names the picture. See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
out=$top/out/demo
usage() {
  cat <<'EOF'
Usage: scripts/demo.sh [--out DIR]

Installs what is missing (Debian packages), builds, renders a textured room through which people walk (300 frames, exact
ground truth), runs player, frontend, mapper and loop closer on it over LCM in lock-step, prints a table and names the
picture of the trajectory. A page in the browser shows it live. --out: where it goes (default: out/demo in the project).
EOF
}
while [ $# -gt 0 ]; do
  case "$1" in
    --out) [ $# -ge 2 ] || { echo "demo.sh: --out needs a folder" >&2; exit 2; }; out=$2; shift 2 ;;
    -h | --help) usage; exit 0 ;;
    *) echo "demo.sh: unknown option $1 (see --help)" >&2; exit 2 ;;
  esac
done
say() { echo "demo: $*" >&2; }
"$top/scripts/setup.sh" core viewer
say "building (a few minutes the first time)"
"$top/scripts/build.sh" release dmslam-player dmslam-frontend dmslam-mapper dmslam-loopcloser dmslam-collector dmslam-viewer \
  dmslam-synth
sequence=$out/sequence
if [ ! -f "$sequence/.complete" ]; then
  say "rendering 300 frames of a room with people who walk"
  rm -rf "$sequence"
  mkdir -p "$out"
  "$top/build/release/bin/dmslam-synth" --out "$sequence" --path xyz --frames 300 --moving-share 0.2 --seed 1
  touch "$sequence/.complete"
fi
say "running player, frontend, mapper and loop closer; the page that is named now shows it live"
exec "$top/scripts/run.sh" --sequence "$sequence" --camera "$top/config/synthetic.yaml" --out "$out/run" --lockstep --seed 1 --viewer
