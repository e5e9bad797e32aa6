#!/usr/bin/env bash
# Makes the README's picture of the viewer, docs/images/viewer.png, from a rendered sequence in a headless Chromium:
# scripts/viewer_picture.sh [--sequence DIR] [--out FILE]. DIR: a sequence that dmslam-synth has rendered (default: it is
# rendered now, 240 frames).
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
sequence="" out=$top/docs/images/viewer.png
while [ $# -gt 0 ]; do
  case "$1" in
    --sequence) [ $# -ge 2 ] || { echo "viewer_picture.sh: --sequence needs a folder" >&2; exit 2; }; sequence=$2; shift 2 ;;
    --out) [ $# -ge 2 ] || { echo "viewer_picture.sh: --out needs a file" >&2; exit 2; }; out=$2; shift 2 ;;
    -h | --help) sed -n '2,4s/^# //p' "$0"; exit 0 ;;
    *) echo "viewer_picture.sh: unknown option $1 (see --help)" >&2; exit 2 ;;
  esac
done
work=$(mktemp -d)
trap 'rm -rf -- "$work"' EXIT
"$top/scripts/setup.sh" core viewer browser
"$top/scripts/build.sh" release dmslam-synth dmslam-viewer dmslam-{player,frontend,mapper,loopcloser,collector}
if [ -z "$sequence" ]; then
  sequence=$work/synthetic
  "$top/build/release/bin/dmslam-synth" --quiet --out "$sequence" --path xyz --frames 240 --moving-share 0.15 --actors 1 --seed 1
fi
exec /usr/bin/python3 "$top/tests/system/viewer_picture.py" --top "$top" --sequence "$sequence" --work "$work" --out "$out"
