#!/usr/bin/env bash
# Installs, builds, renders a synthetic sequence with walking people, runs the four processes on it, prints a table and
# names the picture. See --help.
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
out=$top/out/demo me=demo.sh installed=0
case "$(basename "$0")" in dmslam-*) me=$(basename "$0") installed=1 out=dmslam-demo ;; esac  # beside the programs
usage() {
  if [ "$installed" = 1 ]; then
    echo "Usage: $me [--out DIR]"
    echo
    echo "Renders a textured room through which people walk (300 frames, exact"
  else
    echo "Usage: scripts/$me [--out DIR]"
    echo
    echo "Installs what is missing (Debian packages), builds, renders a textured room through which people walk (300 frames, exact"
  fi
  cat <<EOF
ground truth), runs player, frontend, mapper and loop closer on it over LCM in lock-step, prints a table and names the
picture of the trajectory. A page in the browser shows it live.

  --out DIR    where it goes (default: $([ "$installed" = 1 ] && echo "dmslam-demo in the current folder" || echo "out/demo in the project"))
EOF
}
while [ $# -gt 0 ]; do
  case "$1" in
    --out) [ $# -ge 2 ] || { echo "$me: --out needs a folder" >&2; exit 2; }; out=$2; shift 2 ;;
    -h | --help) usage; exit 0 ;;
    *) echo "$me: unknown option $1 (see --help)" >&2; exit 2 ;;
  esac
done
say() { echo "demo: $*" >&2; }
if [ "$installed" = 1 ]; then
  programs=$top/bin run=$top/bin/dmslam-run cameras=$top/share/dmslam/config
else
  programs=$top/build/release/bin run=$top/scripts/run.sh cameras=$top/config
  "$top/scripts/setup.sh" core viewer
  say "building (a few minutes the first time)"
  "$top/scripts/build.sh" release dmslam-player dmslam-frontend dmslam-mapper dmslam-loopcloser dmslam-collector dmslam-viewer \
    dmslam-synth
fi
sequence=$out/sequence
if [ ! -f "$sequence/.complete" ]; then
  say "rendering 300 frames of a room with people who walk"
  rm -rf "$sequence"
  mkdir -p "$out"
  "$programs/dmslam-synth" --out "$sequence" --path xyz --frames 300 --moving-share 0.2 --seed 1
  touch "$sequence/.complete"
fi
say "running player, frontend, mapper and loop closer; the page that is named now shows it live"
exec "$run" --sequence "$sequence" --camera "$cameras/synthetic.yaml" --out "$out/run" --lockstep --seed 1 --viewer
