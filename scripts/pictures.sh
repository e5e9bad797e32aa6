#!/usr/bin/env bash
# Makes the pictures of the README, docs/images/{features,trajectory}.png, from a rendered sequence:
# scripts/pictures.sh [FRAME]. FRAME: the frame whose features are shown (default: 100).
set -euo pipefail
top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
case "${1:-}" in
  -h | --help) sed -n '2,3s/^# //p' "$0"; exit 0 ;;
esac
frame=${1:-100}
[[ $frame =~ ^[1-9][0-9]*$ ]] || { echo "pictures.sh: $frame is not the number of a frame (see --help)" >&2; exit 2; }
work=$(mktemp -d)
trap 'rm -rf -- "$work"' EXIT
"$top/scripts/build.sh" release dmslam-synth dmslam-inprocess
bin=$top/build/release/bin
"$bin/dmslam-synth" --quiet --out "$work/sequence" --path xyz --frames 150 --moving-share 0.15 --actors 1 --seed 1
"$bin/dmslam-inprocess" --sequence "$work/sequence" --camera "$top/config/synthetic.yaml" --seed 1 --pictures "$frame" \
  --out "$work/run" >/dev/null
mkdir -p "$top/docs/images"
picture=$(find "$work/run/pictures" -type f | sort | sed -n 2p)
[ -n "$picture" ] || { echo "pictures.sh: frame $frame was not drawn" >&2; exit 1; }
cp "$picture" "$top/docs/images/features.png"
cp "$work/run/trajectory.png" "$top/docs/images/trajectory.png"
ls -l "$top/docs/images"
