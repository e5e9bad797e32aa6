#!/bin/sh
# Trains the vocabulary that ships with the project, data/vocabulary.dmv. Run it again whenever the descriptor changes.
# Usage: scripts/train_vocabulary.sh [path of dmslam-vocab]
# Images: $DMSLAM_DATA/vocabulary_images (default: ../shared/data beside the project).
set -eu
case "${1:-}" in
  -h | --help) sed -n '2,4s/^# //p' "$0"; exit 0 ;;
esac
root=$(cd "$(dirname "$0")/.." && pwd)
tool=${1:-$root/build/release/bin/dmslam-vocab}
images=${DMSLAM_DATA:-$root/../shared/data}/vocabulary_images
[ -x "$tool" ] || { echo "$tool: no such program; build the target dmslam-vocab or give its path" >&2; exit 1; }
[ -d "$images" ] || { echo "$images: no such folder; set DMSLAM_DATA" >&2; exit 1; }
mkdir -p "$root/data"
"$tool" train --images "$images" --k 10 --levels 5 --features 1000 --seed 1 --out "$root/data/vocabulary.dmv"
"$tool" info "$root/data/vocabulary.dmv"
